"""The convolution of a kernel with the occupied voxels of a grid (thesis 4.3)."""
