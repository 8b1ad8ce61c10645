"""Errors for wrong use. Numerical trouble inside a step is a `Status`, never one of these."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

NEAREST = 3
"""Names that a message has of those that are too many for it."""


class RumoError(Exception):
    """Base class of every error that Rumo raises on purpose."""

    def __reduce__(self) -> tuple[Any, ...]:
        # Exceptions pickle as a call with the message, which is not what their constructors take.
        return _restored, (type(self), self.args), vars(self)


def _restored(kind: type[RumoError], arguments: tuple[Any, ...]) -> RumoError:
    return kind.__new__(kind, *arguments)


class ArgumentError(RumoError, ValueError):
    """An argument has a value that cannot work.

    Parameters
    ----------
    argument : str
        Name of the argument as the caller wrote it.
    got : str
        What came.
    expected : str
        What would have been right.
    cure : str, optional
        What to do about it.
    """

    def __init__(self, argument: str, got: str, expected: str, cure: str = "") -> None:
        self.argument, self.got, self.expected, self.cure = argument, got, expected, cure
        message = f"{argument}: got {got}, expected {expected}."
        super().__init__(f"{message} {cure}" if cure else message)


class ShapeError(ArgumentError):
    """An array has the wrong shape or a sequence the wrong length."""


class FileError(ArgumentError):
    """A file does not hold what it should.

    Parameters
    ----------
    file : path
        Which file.
    line : int or None
        Where in it, counted from 1; None if it is about all of it.
    got, expected, cure : str
        As of `ArgumentError`.
    """

    def __init__(self, file: object, line: int | None, got: str, expected: str, cure: str = "") -> None:
        self.file, self.line = str(file), line
        super().__init__(f"{file}, line {line}" if line else f"{file}", got, expected, cure)


class UnknownNameError(ArgumentError):
    """A name that nothing answers to.

    Parameters
    ----------
    argument : str
        Name of the argument.
    name : object
        What came.
    known : iterable of str
        Names that there are.
    cure : str
        What to do about it, if none of them is like it.
    among : str
        What they are and where all of them can be seen, if they are too many for a message, which then names only
        those that are like what came.
    """

    def __init__(self, argument: str, name: object, known: Iterable[str], cure: str = "", among: str = "") -> None:
        names = list(dict.fromkeys(known))
        close = difflib.get_close_matches(str(name), names, n=NEAREST if among else 1)
        hint = f"Did you mean {' or '.join(map(repr, close))}?" if close else cure
        expected = "one of " + ", ".join(names) if names else "nothing: no name exists here"
        if among:
            expected = f"one of {len(names)} {among}"
        super().__init__(argument, repr(name), expected, hint)


class UnknownAttributeError(UnknownNameError, AttributeError):
    """An attribute that an object does not have."""


class FrozenError(RumoError, AttributeError):
    """Something that stays as it is was to be changed."""


class CallOrderError(RumoError, RuntimeError):
    """Methods were called in an order that cannot work."""


class ForkedError(CallOrderError):
    """A controller was within a step of another thread when its process was forked."""

    def __init__(
        self,
        message: str = "The process was forked while another thread was in this controller; nobody will end its "
        "step. Make another one here, fork before threads begin to step, or start processes by spawn: "
        'multiprocessing.get_context("spawn").',
    ) -> None:
        super().__init__(message)


class UnstableModeWarning(UserWarning):
    """A scheme predicts that a mode of the model decays which grows: plans will not see what they have to hold."""


class PoorDampingWarning(UserWarning):
    """A loop will swing: by the scheme that predicts, or by its weights."""


class PlantError(RumoError, RuntimeError):
    """The plant could not be integrated; `log` holds the run up to that sample.

    Attributes
    ----------
    log : xarray.Dataset or None
        Everything recorded before the failure.
    """

    def __init__(self, message: str, log: Any = None) -> None:
        super().__init__(message)
        self.log = log


class CampaignError(RumoError, RuntimeError):
    """A campaign cannot go on. What is stored stays, and starting it again goes on from there."""
