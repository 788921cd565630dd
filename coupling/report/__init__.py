"""A run as one HTML page that opens without a network."""

from coupling.report.run_report import write_report

__all__ = ["write_report"]
