"""What the scanner sees of a synthetic corridor: flight, pulses, returns."""
