"""Training and tuning: the loss, the loop, the search without gradient (thesis 4.5, 5.2)."""
