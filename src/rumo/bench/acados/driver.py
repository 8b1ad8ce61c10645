"""acados' generated solver in a loop in C, so that what is timed is acados and not Python."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from rumo.errors import RumoError
from rumo.kernel.tailored import SOURCES, compiler
from rumo.signals import Array

COUNTS = ("horizon", "states", "inputs", "outputs", "memory", "told", "guess")
POINTERS = ("config", "dims", "in", "out", "solver", "options", "capsule")
FUNCTIONS = {
    "set_all": "ocp_nlp_set_all",
    "get_all": "ocp_nlp_get_all",
    "set_guess": "ocp_nlp_set",
    "set_option": "ocp_nlp_solver_opts_set",
    "set_cost": "ocp_nlp_cost_model_set",
    "set_limits": "ocp_nlp_constraints_model_set",
    "get": "ocp_nlp_get",
    "get_at": "ocp_nlp_out_get",
}
"""Those of acados that the loop calls, beside `solve` of the generated solver."""
GUESSES = {"LIFTED_IRK": 0, "IRK": 1, "DISCRETE": 2}
"""How an integrator is told where to begin: it keeps its own, slopes, states at the ends of intervals."""


class Target(ctypes.Structure):
    """`acados` of driver.c."""

    _fields_ = (
        *((name, ctypes.c_int) for name in COUNTS),
        ("sampling_time", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in (*POINTERS, "solve", *FUNCTIONS)),
    )


@dataclass(frozen=True)
class Replay:
    """What came of a recorded drive.

    Attributes
    ----------
    times : ndarray, shape (n, 2)
        Of preparation and feedback [s].
    commands : ndarray, shape (n, nu)
        In units of the inputs' ranges.
    statuses : ndarray of int, shape (n,)
        acados' status of the feedback, or else that of its QP: 0 is success.
    """

    times: Array
    commands: Array
    statuses: np.ndarray


def replay(
    target: Target, drive: Mapping[str, Array], offset: Array, guess: tuple[Array, Array], decided: Array
) -> Replay:
    """Replay a drive; see driver.c for what it consists of."""
    told = [np.ascontiguousarray(drive[name], dtype=float) for name in ("x", "reference", "applied")]
    count, (guess_x, guess_u) = len(told[0]), guess
    room = np.zeros(guess_x.size + target.outputs + target.inputs + guess_x.shape[1])
    result = Replay(np.zeros((count, 2)), np.zeros((count, target.inputs)), np.zeros(count, dtype=np.int32))
    begin = [np.array(values, dtype=float, order="C") for values in (guess_x, guess_u, decided)]
    outcome = (result.times, result.commands, result.statuses)
    arrays = (*told, np.ascontiguousarray(offset, dtype=float), *begin, room, *outcome)
    _library().replay(ctypes.byref(target), count, *(array.ctypes.data_as(ctypes.c_void_p) for array in arrays))
    return result


@cache
def _library() -> Any:
    """The loop, compiled anew in each process: it is a page."""
    with tempfile.TemporaryDirectory(prefix="rumo-bench-") as folder:
        made = Path(folder, "driver.so")
        command = [*compiler(), "-std=c11", "-O2", "-shared", "-fPIC", "-Wall", "-Werror", f"-I{SOURCES / 'src'}"]
        done = subprocess.run(
            [*command, "-o", str(made), str(Path(__file__).with_name("driver.c"))],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise RumoError(f"The loop that drives acados does not compile: {done.stderr.strip()[-500:]}")
        return ctypes.CDLL(str(made))
