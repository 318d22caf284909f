"""The ancillary dataset: labelled towers, crops, voxels and the split (thesis 5.1, 4.2)."""
