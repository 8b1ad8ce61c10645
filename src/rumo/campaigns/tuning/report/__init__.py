"""What is shown of a tuning."""

from rumo.campaigns.tuning.report.page import report

__all__ = ["report"]
