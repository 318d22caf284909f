"""The page with every table and figure, ours beside the thesis."""

from scenenet.report.page import write_report

__all__ = ["write_report"]
