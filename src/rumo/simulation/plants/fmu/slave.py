"""An instance of an FMU for co-simulation, of FMI 2 or 3 alike."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import mkdtemp
from typing import Any
from weakref import finalize

from rumo.errors import FileError, PlantError
from rumo.extras import required


class Slave:
    """An FMU, extracted, loaded and instantiated; all of that is undone with it.

    Parameters
    ----------
    file : path
        Of the FMU.
    description : object
        Its model description, as FMPy reads it.

    Raises
    ------
    FileError
        If it cannot be loaded, such as one for other systems.
    """

    def __init__(self, file: Path, description: Any) -> None:
        fmpy = required("fmpy", "fmu", "FmuPlant")
        simulation = required("fmpy.simulation", "fmu", "FmuPlant")
        self._said: list[str] = []
        said = self._said  # a method would keep the instance alive

        def listen(*message: Any) -> None:
            text = message[-1]
            said.append(text.decode(errors="replace") if isinstance(text, bytes) else str(text))

        self._listen = listen
        folder = Path(mkdtemp())
        clean = finalize(self, shutil.rmtree, folder, ignore_errors=True)
        try:
            fmpy.extract(str(file), str(folder))
            self._fmu: Any = simulation.instantiate_fmu(str(folder), description, "CoSimulation", logger=listen)
        except Exception as error:  # FMPy's own are of this class
            clean()
            raise FileError(file, None, f"an FMU that cannot be loaded ({error})", "one for this system") from error
        clean.detach()
        finalize(self, _free, self._fmu, folder)
        self._name = Path(file).name
        self._old = description.fmiVersion.startswith("2")
        self._fresh = True

    def begin(self, values: Mapping[int, float]) -> None:
        """Go back to time 0, with some variables set before the model finds its initial state."""
        if not self._fresh:
            self._call(self._fmu.reset)
        self._fresh = False
        if self._old:
            self._call(self._fmu.setupExperiment, startTime=0.0)
        self.write(list(values), list(values.values()))
        self._call(self._fmu.enterInitializationMode)
        self._call(self._fmu.exitInitializationMode)

    def read(self, references: Sequence[int]) -> list[float]:
        """Values of variables."""
        return self._call(self._fmu.getReal if self._old else self._fmu.getFloat64, list(references))

    def write(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set variables."""
        if references:
            self._call(self._fmu.setReal if self._old else self._fmu.setFloat64, list(references), list(values))

    def go(self, time: float, step: float) -> None:
        """On from a time, for a step [s]."""
        answer = self._call(self._fmu.doStep, time, step)
        # Of FMI 3: an event, whether to end, an early return, and the time reached.
        if answer is not None and (answer[1] or answer[2]):
            raise PlantError(f"{self._name} ended at {answer[3]:g} s, within the step from {time:g} s on.")

    def _call(self, function: Any, *arguments: Any, **named: Any) -> Any:
        self._said.clear()
        try:
            return function(*arguments, **named)
        except Exception as error:  # FMPy's own are of this class
            raise PlantError(" ".join([f"{self._name}: {error}", *self._said])) from None


def _free(fmu: Any, folder: Path) -> None:
    fmu.freeInstance()
    shutil.rmtree(folder, ignore_errors=True)
