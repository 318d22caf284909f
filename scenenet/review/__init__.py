"""What people know about the towers that were found: their decisions, and registers of assets."""
