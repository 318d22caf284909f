"""SCENE-Net: power-line towers in LiDAR point clouds from 11 parameters with a meaning.

The package follows the way of the data: ``pointcloud`` -> ``towers`` -> ``crops`` -> ``voxels`` ->
``split`` -> ``training`` -> ``tuning`` -> ``evaluation`` -> ``inference`` -> ``report``.
A module imports only what comes before it; ``docs/design.md`` has the list and the reasons.
"""
