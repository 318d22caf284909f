"""The report: every table and figure, with the numbers of the thesis."""

from scenenet.report.page import write_report

__all__ = ["write_report"]
