"""Campaigns: many drives that differ, and what can be said of them all."""
