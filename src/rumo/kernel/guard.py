"""The failure policy of the C core by itself, for controllers whose solver is somewhere else."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np

from rumo.kernel._core import Guard as _Guard
from rumo.kernel.description import BOUNDS, SIZES, as_numbers, members, nothing_known
from rumo.kernel.settings import Settings
from rumo.signals import Array
from rumo.status import STATUSES, Status


class Trajectory(NamedTuple):
    """Inputs (N, nu), states (N + 1, nx) and other unknowns of the intervals (N, ni)."""

    u: Array
    x: Array
    inner: Array


class Guard:
    """Decides what is applied, whatever a solver came to: its plan, else the one before, shifted, else the safe input.

    Once a sample, `admit` says whether the measurement can be used, and `follow` takes what the solver came to. The
    solver starts from `next` while the guard `has_guess`, else from a state at rest: see `rest`.

    Parameters
    ----------
    sizes : mapping of str to int
        horizon, states, algebraic, inputs and delay.
    values : mapping of str to ndarray
        `shift_stages`, `shift_shares`, `shift_intervals`: where the next sample's intervals lie on this horizon;
        `inner_signals`, `inner_nodes` (ni,): what the other unknowns are and where in their interval; `input_lower`,
        `input_upper` (nu,) or (N, nu), `move_lower`, `move_upper`, `safe_input` (nu,); what is known of sensors, as
        `sensors_turn` (nx,). Others are not looked at.
    settings : Settings
        Of these, the gate's.

    Raises
    ------
    ValueError
        If something is missing, has another shape, or cannot be what it says.
    """

    def __init__(self, sizes: Mapping[str, int], values: Mapping[str, Array], settings: Settings) -> None:
        self._sizes = dict.fromkeys(SIZES, 0) | {name: sizes[name] for name in SIZES if name in sizes}
        inner = len(values["inner_signals"])
        # To a guard, all unknowns of an interval but its state are the same.
        self._sizes |= {"substeps": 1, "explicit_scheme": 0, "inner": inner - self._sizes["algebraic"]}
        # Copying what lies one interval later would be as good, but for rounding at the last.
        given: dict[str, Any] = self._sizes | {"shift_same_rows": 0}
        numbers = as_numbers(self._sizes, {name: values[name] for name in BOUNDS})
        for member in members("rumo_guard_data"):
            if member.kind in ("ints", "doubles"):
                kind = np.int32 if member.kind == "ints" else np.float64
                array = numbers.get(member.name, values.get(member.name))
                if array is None and member.name.startswith("sensors_"):
                    array = nothing_known(self._sizes)[member.name]
                given[member.name] = np.ascontiguousarray(array, dtype=kind)
        self._guard = _Guard(given, asdict(settings))
        N, nx, nu = self._sizes["horizon"], self._sizes["states"], self._sizes["inputs"]
        self._shapes = (N, nu), (N + 1, nx), (N, inner)

    def configure(self, settings: Settings) -> None:
        """Take over other settings of the gate."""
        self._guard.configure(asdict(settings))

    def update(self, values: Mapping[str, Array]) -> None:
        """Take over other bounds, move bounds or another safe input; nothing changes where one is wrong."""
        self._guard.update(as_numbers(self._sizes, values))

    def reset(self) -> None:
        """Forget everything; the inputs already decided are the safe input."""
        self._guard.reset()

    @property
    def applied(self) -> Array:
        """Inputs already decided (max(delay, 1), nu), oldest first; `follow` appends its command."""
        inputs = np.empty((max(self._sizes["delay"], 1), self._sizes["inputs"]))
        self._guard.get_applied(inputs)
        return inputs

    @applied.setter
    def applied(self, inputs: Array) -> None:
        self._guard.set_applied(np.ascontiguousarray(inputs, dtype=float))

    @property
    def counts(self) -> Counter[Status]:
        """Outcomes of all samples since the last reset."""
        return Counter({status: n for status, n in zip(STATUSES, self._guard.counts(), strict=True) if n})

    @property
    def has_guess(self) -> bool:
        """Whether the next solution may start from `next`, or from the state at rest that was announced."""
        return self._guard.has_guess

    def rest(self) -> Array:
        """Announce that the next solution starts from a state at rest; returns inputs (N, nu) to start with."""
        u = np.empty(self._shapes[0])
        self._guard.rest(u)
        return u

    def keep(self, straying: float) -> bool:
        """Whether a guess is kept that was prepared: not if it strays from the dynamics, and those before it did not.

        `straying` is how far it is from satisfying the dynamics, over what the inputs can do; 0 where that does not
        matter.
        """
        return self._guard.keep(straying)

    def drop(self) -> None:
        """Say that the guess is of no use: a preparation has failed."""
        self._guard.drop()

    def admit(self, x: Array, reference: Array, reach: Array | None) -> Status:
        """Whether a measurement can be used: OPTIMAL, or why not.

        Parameters
        ----------
        x : ndarray, shape (nx,)
            The measured state.
        reference : ndarray
            All that is wanted.
        reach : ndarray, shape (nx,), or None
            How far all inputs together can move each state over the next stages; where it is 0, there is nothing to
            compare with, and where it is not known, no gate.
        """
        wanted = np.ascontiguousarray(reference, dtype=float)
        reached = None if reach is None else np.ascontiguousarray(reach, dtype=float)
        return STATUSES[self._guard.admit(np.ascontiguousarray(x, dtype=float), wanted, wanted.size, reached)]

    @property
    def taken(self) -> Array:
        """The measurement (nx,) that was admitted, as it is to be used: what is held back of it is predicted."""
        x = np.empty(self._sizes["states"])
        self._guard.taken(x)
        return x

    @property
    def surprised(self) -> bool:
        """Whether a reading of the last sample that is used was farther from the prediction than is usual."""
        return self._guard.surprised

    @property
    def health(self) -> Array:
        """Of readings with a symptom: how many deviations off, for how many samples, and which (3 nx,); else 0."""
        symptoms = np.empty(3 * self._sizes["states"])
        self._guard.health(symptoms)
        return symptoms

    def expect(self, A: Array) -> None:
        """Say how the state after a sample depends on that before it, A (nx, nx): once a sample, after `follow`."""
        self._guard.expect(np.ascontiguousarray(A, dtype=float))

    def unwound(self, x: Array) -> Array:
        """A measurement (nx,) as it is judged: old readings with how far plans have gone since, each by itself, and
        angles next to what is predicted. `taken` is what all that are used say of now."""
        taken = np.empty(self._sizes["states"])
        self._guard.unwound(np.ascontiguousarray(x, dtype=float), taken)
        return taken

    def follow(self, candidate: Trajectory | None, cause: Status) -> tuple[Status, Status]:
        """Apply what a solver came to, or what is followed without it; the plan is in `plan` then.

        A candidate counts if all of it is finite and its status is one with a solution, or BUDGET_EXCEEDED.

        Returns
        -------
        status, cause : Status
            Of what is applied, and why; SOLVER_FAILED where a solution was none.
        """
        u, x, inner = (None, None, None) if candidate is None else map(_contiguous, candidate)
        status, why = self._guard.follow(u, x, inner, STATUSES.index(cause))
        return STATUSES[status], STATUSES[why]

    def take_back(self) -> None:
        """Undo what was applied at the last sample: another candidate is to be followed at the same one."""
        self._guard.take_back()

    @property
    def plan(self) -> Trajectory:
        """What is applied: inputs already decided first, states and other unknowns NaN where no plan is left."""
        return self._trajectory(later=False)[0]

    @property
    def next(self) -> Trajectory | None:
        """The plan one sample later: what is followed without a solution, and the next guess; None without a plan."""
        trajectory, found = self._trajectory(later=True)
        return trajectory if found else None

    def _trajectory(self, later: bool) -> tuple[Trajectory, bool]:
        trajectory = Trajectory(*(np.empty(shape) for shape in self._shapes))
        return trajectory, self._guard.plan(*trajectory, later)


def _contiguous(array: Array) -> Array:
    return np.ascontiguousarray(array, dtype=float)
