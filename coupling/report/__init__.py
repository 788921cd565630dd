"""A run as one HTML page that opens without a network."""

from coupling.report.page import write_report

__all__ = ["write_report"]
