"""From one sample's horizon to the next's."""

from __future__ import annotations

import numpy as np

from rumo.transcription import Transcription


class Shift:
    """Where on a horizon one sample later is.

    Parameters
    ----------
    transcription : Transcription
        Its grid and its intervals' unknowns.

    Attributes
    ----------
    stages, shares : ndarray, shape (N + 1,)
        The stage before, and how far towards the next, as a share; beyond 1 at the end.
    intervals : ndarray, shape (N,)
        The interval in whose time the middle of each lies then.
    """

    def __init__(self, transcription: Transcription) -> None:
        problem = transcription.problem
        times, steps, last = problem.times, problem.steps, problem.horizon - 1
        later = times + problem.sampling_time
        # A time that is a stage's but for rounding is that stage's.
        nearly = 1e-9 * problem.sampling_time
        self.stages = np.minimum(np.searchsorted(times, later + nearly, side="right") - 1, last).astype(np.int32)
        self.shares = np.round((later - times[self.stages]) / steps[self.stages], 9)
        middle = 0.5 * (later[:-1] + later[1:])
        self.intervals = np.minimum(np.searchsorted(times, middle, side="right") - 1, last).astype(np.int32)
