"""From voxels at or above tau to towers: clusters, bodies, conductors."""
