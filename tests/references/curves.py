"""Curves to try paths on."""

import numpy as np
from hypothesis import strategies as st

SIZES = st.floats(0.5, 500.0)


@st.composite
def lobed(draw):
    """Points (n, 2) around a closed curve: a circle with some waves."""
    size, waves = draw(SIZES), draw(st.integers(2, 4))
    depth, phase = draw(st.floats(0.0, 0.15)), draw(st.floats(0.0, 6.0))
    angle = np.linspace(0.0, 2.0 * np.pi, draw(st.integers(40, 120)), endpoint=False)
    radius = size * (1.0 + depth * np.cos(waves * angle + phase))
    way = draw(st.sampled_from([1.0, -1.0]))
    return np.column_stack([radius * np.cos(angle), way * radius * np.sin(angle)])


@st.composite
def winding(draw):
    """Points (n, 2) along an open curve that turns left and right, never by more than 0.3 rad from one to the next."""
    size = draw(SIZES)
    turns = draw(st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=40))
    heading = np.cumsum(turns)
    return size * np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)


def moved(points, angle, shift):
    """Points turned and shifted."""
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + shift
