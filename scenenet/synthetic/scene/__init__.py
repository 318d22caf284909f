"""What stands in a synthetic corridor: terrain, vegetation, towers, the line."""
