"""Training and tuning: losses, training by gradient, search, choice of tau (thesis 4.5, 5.2)."""
