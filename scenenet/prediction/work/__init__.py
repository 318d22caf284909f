"""What a prediction keeps on disk between its stages: voxels, points, predictions, shapes."""
