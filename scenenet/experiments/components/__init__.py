"""Who does the work: rules alone, models alone, and both, beside trivial and other answers."""
