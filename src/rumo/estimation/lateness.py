"""How late measurements are: in samples, or in seconds."""

from __future__ import annotations

import numpy as np

from rumo.checks import as_mapping, non_negative_number
from rumo.errors import ArgumentError
from rumo.signals import Array, Signals


def lateness(late: object, age: object, measured: Signals, sampling_time: float, owner: str) -> Array:
    """Samples, and fractions of one, from each measurement to its arrival (m,).

    Parameters
    ----------
    late, age : mapping of str to float
        By the names of measurements; in samples, and in seconds.
    measured : Signals
        What is measured.
    sampling_time : float
        [s].
    owner : str
        Whose settings they are, for messages.
    """
    late, age = as_mapping(late, f"{owner}.late"), as_mapping(age, f"{owner}.age")
    for argument, ages in (("late", late), ("age", age)):
        for name, value in ages.items():
            measured.index(name, f"{owner}.{argument}")
            if non_negative_number(value, f"{owner}.{argument}[{name!r}]") == np.inf:
                raise ArgumentError(f"{owner}.{argument}[{name!r}]", "inf", "a finite number")
    for name in late.keys() & age.keys():
        raise ArgumentError(f"{owner}.age[{name!r}]", f"{age[name]} s", "nothing: late says it in samples")
    return np.array([late.get(name, age.get(name, 0.0) / sampling_time) for name in measured], dtype=float)
