"""What a campaign is: a recipe, what varies about it and how, who drives, and what is asked of the drives."""

from rumo.campaigns.specification.campaign import Campaign, Tasks

__all__ = ["Campaign", "Tasks"]
