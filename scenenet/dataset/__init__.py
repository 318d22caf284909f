"""The training data: labelled towers, crops, voxels and the split (thesis 5.1, 4.2).

- ``labelled_towers``: towers in labelled points, by DBSCAN.
- ``crops``: the surroundings of each tower.
- ``voxels``: grids, the measurement phi and the labels of voxels.
- ``voxel_counts``: the compiled loops that count points in voxels.
- ``voxel_cache``: the voxel samples of a survey on disk.
- ``zarr_store``: the file format of crops and voxel samples.
- ``split``: training, validation and test parts.
- ``folds``: folds for cross-validation.
- ``batches``: voxel samples combined into batches for a model.
"""
