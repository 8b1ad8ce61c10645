"""Two campaigns, or two drives, beside each other."""

from rumo.campaigns.comparison.campaigns import compare_campaigns
from rumo.campaigns.comparison.drives import compare_drives

__all__ = ["compare_campaigns", "compare_drives"]
