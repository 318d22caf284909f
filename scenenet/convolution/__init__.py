"""The occupancy convolution: a kernel over the occupied voxels of a grid (thesis 4.3)."""
