"""The portable core as a build that shows where each plan was linearised; see core/tests/watched.c."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path
from unittest.mock import patch

import numpy as np

import rumo
from rumo.controllers.engines import core as engine
from rumo.kernel import Build
from rumo.kernel.tailored import COMMON, GCC, compiler

CORE = Path(__file__).parents[2] / "core"


class Watch:
    """Controllers on a build of the core made in a folder, and what their last step was asked to solve."""

    def __init__(self, folder: Path) -> None:
        library = folder / "watched.so"
        includes = [f"-I{CORE / part}" for part in ("include", "src")]
        source = str(CORE / "tests" / "watched.c")
        command = [*compiler(), *COMMON, *GCC, "-fPIC", *includes, "-o", str(library), source, "-lm"]
        subprocess.run(command, check=True, timeout=300)
        loaded = ctypes.CDLL(str(library))
        self._watch, self.solutions = loaded.watch_steps, loaded.watched_solutions
        self._watch.argtypes, self._watch.restype = [ctypes.c_void_p], None
        self.solutions.restype = ctypes.c_longlong
        self.build = Build("watched", ctypes.addressof(ctypes.c_char.in_dll(loaded, "rumo_core")), loaded)

    def controller(self, problem, scheme, **settings) -> rumo.RealTimeIteration:
        """A controller on this build."""
        with patch.object(engine, "portable", lambda: self.build):
            return rumo.RealTimeIteration(problem, scheme, backend="portable", **settings)

    def on(self, numbers: np.ndarray | None) -> None:
        """Write the last two solutions of the next step to an array (2, size), or no longer."""
        self._watch(None if numbers is None else numbers.ctypes.data)
