"""SCENE-Net: power-line towers in LiDAR point clouds, from 11 interpretable parameters.

``docs/development/architecture.md`` lists the packages in their order; each imports only packages
before it.
"""

import os

# Threads of a parallel loop wait for each other at its end, and OpenMP lets them do so by spinning
# for milliseconds, each on a core that others need: torch's threads those of our loops, and another
# process all of them. A loop of half a millisecond then takes seven. After some microseconds they
# give the core away now. Here, because OpenMP reads it once, when torch is imported.
os.environ.setdefault("GOMP_SPINCOUNT", "3000")
