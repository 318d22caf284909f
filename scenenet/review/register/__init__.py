"""An asset register compared with the towers that were found."""
