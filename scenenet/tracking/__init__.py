"""Every training as a run in MLflow."""
