"""Lanes of CommonRoad scenarios (XML of 2018b to 2020a): lanelets, one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import Any
from xml.etree import ElementTree

import numpy as np

from rumo.errors import FileError, UnknownNameError
from rumo.references.loaders.delimited import Table
from rumo.signals import Array


def read_commonroad(file: str | FilePath, lanelets: Sequence[int] | None = None) -> Table:
    """Middle and widths of lanelets of a scenario, those that were named, or the longest chain of successors.

    Raises
    ------
    FileError
        If it is no XML of a scenario, or a lanelet's bounds do not go together.
    UnknownNameError
        If a lanelet is named that is not there.
    """
    known = {element.get("id", ""): element for element in _root(file).iter("lanelet")}
    if not known:
        raise FileError(file, None, "no lanelets", "a scenario of CommonRoad with some")
    chain = _longest(known) if lanelets is None else [str(lanelet) for lanelet in lanelets]
    middles, widths = list[Array](), list[Array]()
    for name in chain:
        if name not in known:
            raise UnknownNameError("lanelets", name, known)
        left, right = (_bound(file, known[name], side) for side in ("leftBound", "rightBound"))
        if left.shape != right.shape:
            got = f"lanelet {name} with {len(left)} points on the left and {len(right)} on the right"
            raise FileError(file, None, got, "as many on both sides")
        middle, width = 0.5 * (left + right), np.linalg.norm(left - right, axis=1)
        # Where one ends the next begins.
        first = 1 if middles and np.linalg.norm(middle[0] - middles[-1][-1]) < 1e-3 else 0
        middles.append(middle[first:])
        widths.append(0.5 * width[first:])
    points, half = np.concatenate(middles), np.concatenate(widths)
    # Which line of the file a point came from is lost; points are counted instead.
    columns = {"x": points[:, 0], "y": points[:, 1], "left": half, "right": half}
    return Table(f"{file}, points of lanelets {', '.join(chain)}", columns, list(range(1, len(points) + 1)))


def _root(file: str | FilePath) -> ElementTree.Element:
    data = FilePath(file).read_bytes()
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise FileError(file, error.position[0], str(error), "well-formed XML") from None
    except (ValueError, LookupError) as error:  # an encoding that nobody knows
        raise FileError(file, 1, str(error), "XML in UTF-8") from None
    if root.tag != "commonRoad":
        raise FileError(file, 1, f"<{root.tag}>", "a scenario, <commonRoad>")
    return root


def _bound(file: str | FilePath, lanelet: ElementTree.Element, side: str) -> Array:
    """Points (n, 2) of one side."""
    name, points = lanelet.get("id", ""), list[tuple[float, float]]()
    for point in lanelet.iterfind(f"{side}/point"):
        texts = [point.findtext(axis, "") for axis in ("x", "y")]
        try:
            x, y = (float(text) for text in texts)
        except ValueError:
            raise FileError(file, None, f"{texts} in the {side} of lanelet {name}", "x and y [m]") from None
        if not (np.isfinite(x) and np.isfinite(y)):
            raise FileError(file, None, f"{texts} in the {side} of lanelet {name}", "finite numbers [m]")
        points.append((x, y))
    if len(points) < 2:
        raise FileError(file, None, f"{len(points)} points in the {side} of lanelet {name}", "at least two")
    return np.array(points)


def _longest(known: dict[str, Any]) -> list[str]:
    """Lanelets from one without predecessor on, by first successors, the longest of such chains."""
    following = {name: [s.get("ref", "") for s in lanelet.iterfind("successor")] for name, lanelet in known.items()}
    later = {name for names in following.values() for name in names}
    chains = list[list[str]]()
    for name in [name for name in known if name not in later] or list(known)[:1]:
        chain = list[str]()
        while name in known and name not in chain:
            chain.append(name)
            name = next(iter(following[name]), "")
        chains.append(chain)
    return max(chains, key=len)
