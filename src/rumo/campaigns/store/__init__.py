"""A campaign's folder, of which nothing is ever half written."""

from rumo.campaigns.store.store import Store, read_head, read_rows

__all__ = ["Store", "read_head", "read_rows"]
