"""How steps are damped, so that each is worth it where its inputs lead: Levenberg's and Marquardt's method.

By how much inputs change from block to block, over their ranges, costs the damping times the square of what that
differs by from the guess. As core/src/damped_steps.c. Source: Nocedal and Wright (2006), sections 4.1 and 10.3.
"""

from __future__ import annotations

from rumo.signals import Array

SHARE_HELD = 0.1
"""Of what a step promises, what it has to hold."""
HARDLY_KEPT, PROMISE_KEPT = 0.25, 0.75
"""Shares below and above which a step hardly keeps its promise, and keeps it."""
DAMPED_MORE, DAMPED_LESS = 4.0, 0.25
"""Damping of what promised too much, over the one before, and of what kept its promise."""
UNDAMPED = 1e-3
"""The share of the first damping at which it goes."""


def damping_for(less: float, moves: Array) -> float:
    """At which a step costs as much as it promises; by what it changes moves over the inputs' ranges (nb, nu)."""
    squares = float((moves**2).sum())
    return less / squares if squares > 0.0 and less > 0.0 else 0.0


def damping_after(damping: float, first: float, share: float) -> float:
    """The next damping, after a step that was worth this share of what it promised; `first` is the least at once."""
    if not share >= SHARE_HELD:
        return DAMPED_MORE * damping if damping > 0.0 else first
    if share < HARDLY_KEPT:
        return 2.0 * damping if damping > 0.0 else 0.1 * first
    if share < PROMISE_KEPT:
        return damping
    return DAMPED_LESS * damping if damping > UNDAMPED * first else 0.0
