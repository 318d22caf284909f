"""One file for each measurement. The registry imports every file in this package."""
