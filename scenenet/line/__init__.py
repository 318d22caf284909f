"""The line between the towers: conductors, spans and clearances."""
