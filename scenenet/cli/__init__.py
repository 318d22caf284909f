"""The command line ``scenenet``."""

from scenenet.cli.app import main

__all__ = ["main"]
