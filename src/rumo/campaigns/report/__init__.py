"""What is shown of a campaign."""

from rumo.campaigns.report.page import report

__all__ = ["report"]
