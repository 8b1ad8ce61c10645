"""Packages that are installed only where they are wanted."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rumo.errors import ArgumentError


def required(module: str, extra: str, what: str) -> Any:
    """A module of an optional package.

    Parameters
    ----------
    module : str
        To be imported.
    extra : str
        Of Rumo, that installs it.
    what : str
        Needs it, for the message.

    Raises
    ------
    ArgumentError
        If it is not installed.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if (error.name or "").partition(".")[0] != package:
            raise  # it is there, and broken
        raise ArgumentError(
            what, f"an installation without {package}", "one with it", f'pip install "rumo[{extra}]"'
        ) from None
