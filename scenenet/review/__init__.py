"""What people know about the towers that were found: registers of their assets."""
