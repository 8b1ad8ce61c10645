"""Scenarios as plain data: bases by name, their arguments, and all settings by dotted names."""

from rumo.scenarios.arguments import Argument, Plain, arguments_of
from rumo.scenarios.bases import BASES
from rumo.scenarios.kinds import KINDS
from rumo.scenarios.recipe import Recipe
from rumo.scenarios.settings import changed, settings_of

__all__ = ["BASES", "KINDS", "Argument", "Plain", "Recipe", "arguments_of", "changed", "settings_of"]
