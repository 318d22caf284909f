"""One file for each kernel. The registry imports every file in this package."""
