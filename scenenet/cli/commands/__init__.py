"""The commands, one file each: ``command`` with its help and ``EXAMPLES``."""
