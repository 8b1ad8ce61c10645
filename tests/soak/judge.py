"""Judges a drive, all steps at once, from what plans say and where they were linearised."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from soak.closest import ClosestSolutions
from soak.driven import Drive, layouts
from soak.solutions import Solutions
from soak.verdict import BAD_MEASUREMENT, BAD_REFERENCE, SOFT, Verdict

AT_ONCE = 256
"""Stages that CasADi evaluates."""


class Judge:
    """Of one structure of problems under a scheme."""

    def __init__(self, transcription: Any) -> None:
        self.layouts = layouts(transcription)
        interval = transcription.interval
        symbol: Any = ca.MX if interval.is_a("MXFunction") else ca.SX
        w, x, u, p = (symbol.sym(name, interval.size1_in(i)) for i, name in enumerate("wxup"))
        xz = w[: len(transcription.problem.model.variables)]
        terms = {
            "phi": interval(w, x, u, p),
            "y": transcription.outputs(xz, u, p),
            "G": transcription.constraints(xz, u, p),
        }
        derivatives = {
            f"{name}_{of}": ca.jacobian(terms[name], v)
            for name, of, v in (
                *(("phi", of, v) for of, v in (("w", w), ("x", x), ("u", u))),
                *((name, of, v) for name in "yG" for of, v in (("xz", xz), ("u", u))),
            )
        }
        self.shapes = {name: term.shape for name, term in (terms | derivatives).items()}
        self.coupled = self._coupled(derivatives)
        packed = [ca.vec(ca.densify(term)) for term in (terms | derivatives).values()]
        stage: Any = ca.Function("stage", [w, x, u, p], [ca.vertcat(*packed)])
        self._buffer, self._run = stage.map(AT_ONCE).buffer()
        sizes = [stage.size1_in(i) for i in range(4)] + [stage.size1_out(0)]
        *self._arguments, self._result = (np.zeros((AT_ONCE, size)) for size in sizes)
        for i, argument in enumerate(self._arguments):
            self._buffer.set_arg(i, memoryview(argument))
        self._buffer.set_res(0, memoryview(self._result))

    def _coupled(self, derivatives: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Which unknowns of an interval depend on states before, and on inputs: rounding must not couple others."""
        patterns = [np.array(ca.DM(derivatives[f"phi_{of}"].sparsity(), 1).full() != 0.0) for of in "wxu"]
        reached = patterns[0] | np.eye(len(patterns[0]), dtype=bool)
        for _ in range(len(reached).bit_length()):
            reached = reached @ reached
        return reached @ patterns[1], reached @ patterns[2]

    def evaluate(self, *arguments: np.ndarray) -> np.ndarray:
        """All terms (n, size) of stages whose arguments are rows (n, ...)."""
        n, made = len(arguments[0]), []
        for first in range(0, n, AT_ONCE):
            for own, given in zip(self._arguments, arguments, strict=True):
                own[: n - first] = given[first : first + AT_ONCE]
            self._run()
            made.append(self._result[: n - first].copy())
        return np.concatenate(made)

    def judge(self, drive: Drive) -> Verdict:
        """All steps of a drive."""
        verdict = Verdict(checked=len(drive.status))
        with np.errstate(all="ignore"):
            self._judge_commands(drive, verdict)
            self._judge_causes(drive, verdict)
            verdict.add(self._judge_solutions(drive))
        return verdict

    def _judge_solutions(self, drive: Drive) -> Verdict:
        """Those that seem bad are judged again, more closely, before they are called so."""
        found, steps = Verdict(), np.flatnonzero(drive.status <= SOFT)
        for judge in (Solutions, ClosestSolutions):
            found.bad.clear()
            if len(steps):
                judge(self, drive, steps, found).judge()
            steps = np.array(sorted(found.bad), dtype=int)
        return found

    def _judge_commands(self, drive: Drive, verdict: Verdict) -> None:
        """Whatever happened: finite, within bounds, and within move bounds of what was applied before."""
        problem, d = drive.problem, drive.problem.delay
        u, n = self.layouts[1].of(drive.plans, "u"), problem.numbers
        verdict.blame(~np.isfinite(u).all(axis=(1, 2)), "an input is no number")
        outside = (u[:, d:] < n.input_lower[d:]) | (u[:, d:] > n.input_upper[d:])
        verdict.blame(outside.any(axis=(1, 2)), "an input is out of bounds")
        verdict.blame((u[:, :d] != drive.decided[:, :d]).any(axis=(1, 2)), "an input decided before is another")
        before = np.concatenate([drive.decided[:, -1:], u[:, d:-1]], axis=1)
        inside = (before >= n.input_lower[d:]) & (before <= n.input_upper[d:])
        room = 1e-12 * problem.input_scales + 1e-15 * np.abs(before)
        moves = u[:, d:] - before
        too_far = (moves < n.move_lower - room) | (moves > n.move_upper + room)
        verdict.blame((inside & too_far).any(axis=(1, 2)), "a move is out of bounds")

    def _judge_causes(self, drive: Drive, verdict: Verdict) -> None:
        """What cannot be used is said to be so, and what is used is what was told."""
        missing = (~np.isfinite(drive.measured)).sum(axis=1)
        lost = 2 * missing >= drive.measured.shape[1]
        verdict.blame(lost & (drive.cause != BAD_MEASUREMENT), "a measurement that is none was used")
        weights = drive.problem.numbers.output_weights
        unknown = (~np.isfinite(drive.wanted[:, 1:]) & (weights > 0.0)).any(axis=(1, 2))
        verdict.blame(unknown & (drive.cause < BAD_REFERENCE), "a reference that is none was used")
        verdict.blame(~unknown & (drive.cause == BAD_REFERENCE), "a reference that is one was refused")
        verdict.blame((drive.status < drive.cause), "a status is better than its cause")
        states = self.layouts[1].of(drive.plans, "x")
        verdict.blame((drive.status <= SOFT) & ~np.isfinite(states).all(axis=(1, 2)), "a state is no number")
