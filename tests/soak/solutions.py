"""Whether plans that are said to be solutions are.

The horizon's quadratic program is put together in free inputs alone, from the judge's own derivatives of the scheme's
residual. A plan is a solution if the linearised dynamics and all limits hold, and if forces at limits that are active
balance the slope of the cost. What is left of it, a slope r, bounds the error: the cost is strongly convex with the
Hessian H, in which soft limits count that are exceeded, so the plan's free inputs v are within
`|v_i - v*_i| <= sqrt((H^-1)_ii r' H^-1 r)` of the solution's. That has to be less than 1e-6 of their ranges, for limits
that are shifted by at most 1e-7 of their scale.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from soak.stacked import cholesky, inverse, least_squares, solve, times
from soak.told import SHIFT, Told
from soak.verdict import OPTIMAL, SOFT

ERROR = 1e-6
"""Of free inputs, over their ranges, or over the longest step of one where that is longer."""
DYNAMICS = 1e-8
"""Over the terms of the same state and stage; or a tenth of that over its largest value."""
ROUNDING = 1e-12
"""What the judge itself may lose of the terms of a slope."""
SLACK = 1e-6
"""A constraint counts as violated above this share of its scale: as documented."""
CHANGES = 1000
"""Of the set of multipliers at their limits, at most: as many as there are multipliers may not be enough."""
OF_STATES, OF_INPUTS = ("y_xz", "G_xz"), ("y_u", "G_u")
NO_INFLUENCE = 1e-10


class Solutions(Told):
    """Those steps of a drive that are said to be solved, put together again and judged."""

    solve_intervals = staticmethod(solve)

    def judge(self) -> None:
        """Feasible, stationary, and as it says."""
        if not len(self.steps):
            return
        self._read()
        self._judge_what_was_told()
        self._linearise()
        self._evaluate_constraints()
        self._respond()
        self._judge_dynamics()
        self._judge_constraints()
        for chosen in np.array_split(np.arange(len(self.steps)), max(1, len(self.steps) // 500)):
            self._judge_optimality(chosen)

    def _linearise(self) -> None:
        """All terms about the guess, and intervals solved for their unknowns."""
        self.terms, self.A, self.B, self.c = self._linearised(self.w_g, self.x_g[:, :-1], self.u_g)
        self.blurred = [np.zeros_like(self.A), np.zeros_like(self.B)]

    def _linearised(self, w: np.ndarray, x: np.ndarray, u: np.ndarray) -> tuple:
        T, N = self.u.shape[:2]
        parameters = np.broadcast_to(self.problem.parameters, (T, *self.problem.parameters.shape))
        if not self.problem.uniform:
            lengths = np.broadcast_to(self.problem.steps[:, None], (T, N, 1))
            parameters = np.concatenate([parameters, lengths], axis=2)
        packed = self.judge_.evaluate(*(a.reshape(T * N, -1) for a in (w, x, u, parameters)))
        at, terms = 0, {}
        for name, (rows, columns) in self.judge_.shapes.items():
            block = packed[:, at : at + rows * columns].reshape(T, N, columns, rows)
            terms[name] = np.ascontiguousarray(block.transpose(0, 1, 3, 2))
            at += rows * columns
        nx, nu = self.x.shape[2], self.u.shape[2]
        right = np.concatenate([terms["phi_x"], terms["phi_u"], terms["phi"]], axis=3)
        solved = self.solve_intervals(-terms["phi_w"], right)[:, :, : self.size]
        by_state, by_input = (pattern[: self.size] for pattern in self.judge_.coupled)
        A, B = np.where(by_state, solved[..., :nx], 0.0), np.where(by_input, solved[..., nx : nx + nu], 0.0)
        return terms, A, B, solved[..., -1]

    def _judge_dynamics(self) -> None:
        before = self.dx[:, :-1]
        expected = times(self.A, before) + times(self.B, self.du) + self.c
        terms = times(np.abs(self.A), np.abs(before)) + times(np.abs(self.B), np.abs(self.du)) + np.abs(self.c)
        # Adding the guess to a step loses digits of it, at both ends of an interval.
        ends = np.abs(self.w_g[:, :, : self.size])
        lost = times(np.abs(self.A), np.abs(self.x_g[:, :-1])) * 1e-13 + 0.1 * DYNAMICS * ends.max(
            axis=1, keepdims=True
        )
        lost = lost + times(np.abs(self.B), np.abs(self.u_g)) * 1e-15  # and so does that to a guess of inputs
        lost = lost + SHIFT * self.longest * np.linalg.norm(self.S, axis=3)  # of what the inputs' ranges do
        off = np.abs(expected - self.dxz) - DYNAMICS * terms - lost
        doubtful = np.flatnonzero(~(off <= 1e-300).all(axis=(1, 2)))
        if len(doubtful):  # what solving the interval's equations loses, by the size of their terms
            M = self.terms["phi_w"][doubtful]
            size_of = np.abs(inverse(M))
            right = times(np.abs(self.terms["phi_x"][doubtful]), np.abs(before[doubtful]))
            right += times(np.abs(self.terms["phi_u"][doubtful]), np.abs(self.du[doubtful]))
            right += np.abs(self.terms["phi"][doubtful, ..., 0])
            right += times(np.abs(M), times(size_of, right))
            off = off[doubtful] - 1e-13 * times(size_of, right)[..., : self.size]
            most = (
                1e-15
                * self._growth(doubtful)[:, None, None]
                * np.maximum(
                    terms[doubtful].max(axis=2, keepdims=True), np.abs(self.w_g[doubtful]).max(axis=2, keepdims=True)
                )
            )
            bad, unclear = (~(off <= least).all(axis=(1, 2)) for least in (most, 1e-300))
            self.verdict.blame(self.steps[doubtful[bad]], "the linearised dynamics do not hold")
            self.verdict.undecided += int((unclear & ~bad).sum())

    def _evaluate_constraints(self) -> None:
        """Path constraints as linearised, less their limits (T, N, nc), and the size of their terms."""
        D, E = self.terms["G_xz"], self.terms["G_u"]
        limits = self.problem.numbers.limits
        G = self.terms["G"][..., 0]
        self.G = G - limits + times(D, self.dxz) + times(E, self.du)
        terms = np.abs(G) + np.abs(limits) + times(np.abs(D), np.abs(self.dxz)) + times(np.abs(E), np.abs(self.du))
        terms += 1e-3 * times(np.abs(D), np.abs(self.w_g[:, :, : self.size]))  # what adding up the states has lost
        self.G_terms = np.where(np.isfinite(limits), terms, 0.0)

    def _respond(self) -> None:
        """Derivatives by free inputs (n,), blocks' values over their ranges, of states (T, N, size, n) and of rows."""
        problem, (T, N, nu) = self.problem, self.u.shape
        d, scales, blocks = problem.delay, problem.input_scales, problem.blocks.matrix[:, 1:]
        n = blocks.shape[1] * nu
        U = np.zeros((N, nu, n))
        U[d:] = (blocks[:, None, :, None] * np.diag(scales)[:, None, :]).reshape(N - d, nu, n)
        S = np.zeros((T, N, self.size, n))
        state = np.zeros((T, self.x.shape[2], n))
        for k in range(N):
            S[:, k] = self.A[:, k] @ state + self.B[:, k] @ U[k]
            state = S[:, k, : state.shape[1]]
        self.Y = self.terms["y_xz"] @ S + self.terms["y_u"] @ U
        self.J = self.terms["G_xz"] @ S + self.terms["G_u"] @ U
        self.n, self.U, self.S = n, U, S

    def _growth(self, chosen: np.ndarray) -> np.ndarray:
        """By how much rounding grows where intervals are solved for their unknowns: the largest condition."""
        M = self.terms["phi_w"][chosen]
        return (np.linalg.norm(inverse(M), axis=(2, 3)) * np.linalg.norm(M, axis=(2, 3))).max(axis=1, initial=1.0)

    def _lost(self, step: int, place: int) -> np.ndarray:
        """Terms of a slope, where responses are sums that cancel, and rounding of states grows along the horizon."""
        numbers, (A, B) = self.problem.numbers, (np.abs(part[step]) for part in (self.A, self.B))
        prices = 2.0 * numbers.output_weights, np.broadcast_to(2.0 * numbers.l2, numbers.limits.shape)
        by_state, by_input = ([np.abs(self.terms[name][step]) for name in names] for names in (OF_STATES, OF_INPUTS))
        size = np.maximum(
            np.abs(self.w_g[step, :, : self.size]), np.abs(self.w_g[step, :, : self.size] + self.dxz[step])
        )
        lost, nx = np.zeros(self.n), A.shape[2]
        state, drift, unclear = np.zeros((nx, self.n)), np.zeros(nx), np.zeros((nx, self.n))
        for k in range(len(A)):
            blur = A[k] @ unclear + (self.blurred[0][step, k] @ state + self.blurred[1][step, k] @ self.U[k]) / ROUNDING
            S, away = A[k] @ state + B[k] @ self.U[k], A[k] @ drift + 1e-3 * size[k]
            state, drift, unclear = S[:nx], away[:nx], blur[:nx]
            for force, price, of_state, of_input in zip(self.forces, prices, by_state, by_input, strict=True):
                lost += (force[place, k] + price[k] * (of_state[k] @ away)) @ (
                    of_state[k] @ S + of_input[k] @ self.U[k]
                )
                lost += force[place, k] @ (of_state[k] @ blur)
        return lost

    def _judge_constraints(self) -> None:
        """They are what is told, but for what responses to a long step lose."""
        limited = np.isfinite(self.problem.numbers.limits)
        lost = 1e-12 * np.abs(self.J).sum(axis=3) * self.longest
        room = 1e-6 * self.G_terms + SHIFT * self.problem.constraint_scales * self.longest + lost
        told = np.where(limited, np.abs(self.G - self.G_told) <= room, True)
        self.blame(~told.all(axis=(1, 2)), "constraints are not what is told")

    def _judge_optimality(self, chosen: np.ndarray) -> None:
        """Forces of active limits balance the slope of the cost."""
        p, n, T = self.problem, self.n, len(chosen)
        d, nu, numbers, scales = p.delay, self.u.shape[2], p.numbers, p.input_scales
        N = self.u.shape[1]
        Y, J = self.Y[chosen].reshape(T, -1, n), self.J[chosen].reshape(T, -1, n)
        steps, longest = self.steps[chosen], self.longest[chosen, 0]

        values = p.blocks.values(np.eye(N - d)) @ self.u[chosen][:, d:]
        first = np.concatenate([self.decided[chosen, -1:], values], axis=1)
        unheld = self.u[chosen][:, d:] - p.blocks.matrix @ first
        self.verdict.blame(
            steps[
                (np.abs(unheld) > 1e-9 * scales * self.longest[chosen] + 1e-14 * np.abs(first).max()).any(axis=(1, 2))
            ],
            "inputs do not hold over blocks",
        )

        # The step and the slope of the cost.
        y = self.terms["y"][chosen][..., 0] + times(self.terms["y_xz"][chosen], self.dxz[chosen])
        y += times(self.terms["y_u"][chosen], self.du[chosen])
        wanted = self.reference[chosen, 1:]
        Q = 2.0 * numbers.output_weights
        pull = np.where(Q > 0.0, Q * (y - wanted), 0.0)
        pulls = np.where(Q > 0.0, Q * (np.abs(y) + np.abs(wanted)), 0.0).reshape(T, 1, -1)
        W = np.eye(n) - np.eye(n, k=-nu)
        R = 2.0 * (p.block_move_weights * scales**2).ravel()
        moves = (np.diff(first, axis=1) / scales).reshape(T, n)
        slope = (pull.reshape(T, 1, -1) @ Y)[:, 0] + (moves * R) @ W
        lost = (pulls @ np.abs(Y))[:, 0] + (np.abs(moves) * R) @ np.abs(W)
        H = Y.transpose(0, 2, 1) @ (Q.ravel()[:, None] * Y) + W.T @ (R[:, None] * W)

        # Limits: bounds, moves, constraints; -1 at the lower one, 1 at the upper one, 2 at both or soft at its limit.
        v = (values / scales).reshape(T, n)
        guessed = p.blocks.values(np.eye(N - d)) @ self.u_g[chosen][:, d:] / scales
        last_digits = 1e-15 * (np.abs(v) + np.abs(guessed).reshape(T, n))  # of inputs: steps are added to guesses
        lower, upper = ((bound / scales).ravel() for bound in p.block_bounds)
        move_lower, move_upper = ((bound / scales).ravel() for bound in p.block_move_bounds)
        G = self.G[chosen].reshape(T, -1)
        unit = np.tile(p.constraint_scales, N)
        influence = np.linalg.norm(J, axis=2)
        imposed = influence > NO_INFLUENCE * unit
        room = SHIFT * longest * np.minimum(unit, np.where(imposed, influence, 1.0)) + 1e-13 * self.G_terms[
            chosen
        ].reshape(T, -1)
        room += times(np.abs(J), last_digits)
        l1, l2 = np.tile(numbers.l1, N), np.tile(numbers.l2, N)
        hard = np.isinf(l1)
        self.verdict.blame(steps[(imposed & hard & (SLACK * unit + room < G)).any(axis=1)], "a hard limit is exceeded")
        soft_violated = (imposed & ~hard & (SLACK * unit + room < G)).any(axis=1)
        claims = self.drive.status[steps]
        self.verdict.blame(steps[soft_violated & (claims == OPTIMAL)], "optimal, but a soft limit is exceeded")
        counted = self.drive.transcription.imposed.ravel()
        exceeded = (counted & ~hard & (SLACK * unit - room < G)).any(axis=1)
        self.verdict.blame(steps[~exceeded & (claims == SOFT)], "no soft limit is exceeded")

        over = imposed & ~hard & (room < G)
        # One that inputs hardly influence may have kept its price from when they did, or have none.
        either = counted & ~imposed & ~hard & (room < G)
        # Whether rows are imposed that inputs hardly influence depends on how that is measured.
        hardly = (influence > 1e-3 * NO_INFLUENCE * unit) & (influence < 1e3 * NO_INFLUENCE * unit)
        self.unclear = (hardly & (-room < G)).any(axis=1)
        curvature = np.where(over, 2.0 * l2, 0.0)
        H += J.transpose(0, 2, 1) @ (curvature[:, :, None] * J)
        price = np.where(over, l1 + 2.0 * l2 * np.maximum(G, 0.0), 0.0)
        slope += (price[:, None, :] @ J)[:, 0]
        lost += (price[:, None, :] @ np.abs(J))[:, 0] + times(np.abs(H), last_digits) / ROUNDING
        self.forces = pulls.reshape(T, N, -1), price.reshape(T, N, -1)
        near = 1e-2 * SHIFT * longest
        rows = np.concatenate([np.broadcast_to(np.eye(n), (T, n, n)), np.broadcast_to(W, (T, n, n)), J], axis=1)
        at_upper = np.concatenate(
            [v >= upper - near, moves >= move_upper - near, (imposed & ~over & (-room <= G)) | either], axis=1
        )
        at_lower = np.concatenate([v <= lower + near, moves <= move_lower + near, np.zeros_like(over)], axis=1)
        prices = l1 + 2.0 * l2 * (np.maximum(G, 0.0) + room)
        most = np.concatenate([np.full((T, 2 * n), np.inf), prices], axis=1)
        allowed = ERROR * longest[:, 0]
        self._balance(chosen, allowed, H, slope, lost, rows, at_lower, at_upper, most)

    def _balance(self, chosen, allowed, H, slope, lost, rows, at_lower, at_upper, most) -> None:
        """Multipliers by least squares, in the metric in which what is left bounds the error."""
        verdict, steps = self.verdict, self.steps[chosen]
        scale = 1.0 / np.sqrt(np.diagonal(H, axis1=1, axis2=2))
        factor = cholesky(H * scale[:, :, None] * scale[:, None, :])
        white = inverse(factor) * scale[:, None, :]  # L^-1 for H itself
        reach = np.sqrt((white**2).sum(axis=1)).max(axis=1)  # of sqrt((H^-1)_ii)
        left = times(white, slope)
        active = at_lower | at_upper
        count = active.sum(axis=1)
        error = np.full(len(steps), np.nan)
        rounding = np.zeros(len(steps))
        for m in np.unique(count):
            these = np.flatnonzero(count == m)
            forces = np.zeros((len(these), 0))
            if m:
                at = np.nonzero(active[these])[1].reshape(len(these), m)
                C = np.take_along_axis(rows[these], at[:, :, None], axis=1)
                F = white[these] @ C.transpose(0, 2, 1)
                size = np.linalg.norm(F, axis=1)
                size[~(size > 0.0)] = 1.0
                F /= size[:, None, :]
                low = np.where(np.take_along_axis(at_lower[these], at, axis=1), -np.inf, 0.0)
                high = (
                    np.where(
                        np.take_along_axis(at_upper[these], at, axis=1),
                        np.take_along_axis(most[these], at, axis=1),
                        0.0,
                    )
                    * size
                )
                forces = np.clip(least_squares(F, -left[these]), low, high)
                error[these] = np.linalg.norm(left[these] + times(F, forces), axis=1)
                for i in np.flatnonzero(~(error[these] * reach[these] <= 0.1 * allowed[these])):
                    if np.isfinite(F[i]).all() and np.isfinite(left[these[i]]).all() and (high[i] > low[i]).all():
                        best = lsq_linear(
                            F[i], -left[these[i]], (low[i], high[i]), method="bvls", tol=1e-14, max_iter=CHANGES
                        )
                        forces[i] = best.x
                        error[these[i]] = np.linalg.norm(left[these[i]] + F[i] @ best.x)
                        verdict.refined += 1
                forces_lost = np.abs(C).transpose(0, 2, 1) @ (np.abs(forces) / size)[:, :, None]
                lost[these] += forces_lost[:, :, 0]
            else:
                error[these] = np.linalg.norm(left[these], axis=1)
        rounding = ROUNDING * np.linalg.norm(np.abs(white) @ lost[:, :, None], axis=1)[:, 0]
        error, rounding = error * reach, rounding * reach
        good = error <= allowed
        for i in np.flatnonzero(~good):
            growth = 1.0 + 1e-3 * self._growth(chosen[i : i + 1])[0]
            rounding[i] += growth * ROUNDING * reach[i] * np.linalg.norm(np.abs(white[i]) @ self._lost(chosen[i], i))
        bad = (error > allowed + rounding) & (rounding < 1e3 * allowed) & ~self.unclear
        for i in np.flatnonzero(bad):
            verdict.blame(steps[i : i + 1], f"the plan is not optimal: {error[i]:.1e} off, {allowed[i]:.1e} allowed")
        verdict.proven += int(good.sum())
        verdict.undecided += int((~good & ~bad).sum())
        verdict.largest_error = max(verdict.largest_error, float(error[good].max(initial=0.0)))
