"""Searches over settings: Optuna proposes, drives tell what came of it."""
