"""What a model's parameters and predictions mean, and which GENEO properties it has."""
