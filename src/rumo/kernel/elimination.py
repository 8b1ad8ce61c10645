"""The order in which a step's unknowns are solved for, and how steps are put together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rumo.kernel.pivots import pivot_order
from rumo.signals import Array

Positions = Sequence[tuple[int, int]]
"""(row, column) of the structural nonzeros of a matrix, sorted by rows."""


def triangular_blocks(pattern: np.ndarray) -> list[list[int]]:
    """Unknowns in groups that are solved for together, each group depending on earlier ones only.

    Parameters
    ----------
    pattern : ndarray of bool, shape (n, n)
        Which unknown enters which equation; the diagonal counts as set.
    """
    reached = pattern | np.eye(len(pattern), dtype=bool)
    for _ in range(len(pattern).bit_length()):
        reached = reached @ reached
    coupled = reached & reached.T
    # An unknown that depends on another without being coupled to it reaches more of them than that one.
    groups = {tuple(np.flatnonzero(row).tolist()) for row in coupled}
    return [list(group) for group in sorted(groups, key=lambda group: (reached[group[0]].sum(), group))]


def eliminate(
    first: Mapping[str, int],
    positions: Mapping[str, Positions],
    unknowns: int,
    states: int,
    inputs: int,
    samples: Array,
) -> dict[str, np.ndarray]:
    """Tables of `rumo_elimination` for `M dw = A0 dx + B du + defect`.

    Parameters
    ----------
    first : mapping of str to int
        Slot of the first term of each of M, A0, B, defect.
    positions : mapping of str to (row, column) pairs
        Nonzeros of M, A0 and B.
    unknowns, states, inputs : int
        Sizes nw, nx and nu.
    samples : ndarray, shape (points, nw, nw)
        M at some points, for the order of pivots inside the blocks.
    """
    constant = states + inputs
    m_at = {place: first["M"] + e for e, place in enumerate(positions["M"])}
    right: list[dict[int, int]] = [{constant: first["defect"] + r} for r in range(unknowns)]
    for e, (row, column) in enumerate(positions["A0"]):
        right[row][column] = first["A0"] + e
    for e, (row, column) in enumerate(positions["B"]):
        right[row][states + column] = first["B"] + e

    pattern = np.zeros((unknowns, unknowns), dtype=bool)
    for place in m_at:
        pattern[place] = True
    blocks = triangular_blocks(pattern)
    columns: dict[int, list[int]] = {}
    for block in blocks:
        reaching = {column for row in block for column in right[row]}
        reaching |= {c for row, s in m_at if row in block and s not in block for c in columns[s]}
        columns |= dict.fromkeys(block, sorted(reaching))
    result = {place: e for e, place in enumerate((r, c) for r in range(unknowns) for c in columns[r])}

    load: list[tuple[int, int]] = []
    update: list[tuple[int, int, int]] = []
    store: list[tuple[int, int]] = []
    lower: list[int] = []
    upper: list[int] = []
    counts: list[list[int]] = []
    pivots: list[tuple[int, int, int]] = []
    for block in blocks:
        m, reaching = len(block), columns[block[0]]
        before = len(load), len(update), len(store)
        inside = np.ix_(block, block)
        order = pivot_order(pattern[inside], samples[:, inside[0], inside[1]])
        rows, solved = ([block[i] for i in part] for part in order)
        nonzero = np.zeros((m, m + len(reaching) + 1), dtype=bool)
        for i, (row, unknown) in enumerate(zip(rows, solved, strict=True)):
            start = i * nonzero.shape[1]
            place = {column: start + m + j for j, column in enumerate(reaching)}
            own = [(m_at[row, s], start + j) for j, s in enumerate(solved) if (row, s) in m_at]
            own += [(slot, place[column]) for column, slot in sorted(right[row].items())]
            others = sorted(s for r, s in m_at if r == row and s not in block)
            known = [(m_at[row, s], result[s, column], place[column]) for s in others for column in columns[s]]
            nonzero.flat[[at for *_, at in (*own, *known)]] = True
            load += own
            update += known
            store += [(place[column], result[unknown, column]) for column in reaching]
        for p, row in enumerate(rows):
            below, across = np.flatnonzero(nonzero[p + 1 :, p]) + p + 1, np.flatnonzero(nonzero[p, p + 1 :]) + p + 1
            nonzero[np.ix_(below, across)] = True
            pivots.append((row, len(below), len(across)))
            lower += below.tolist()
            upper += across.tolist()
        added = [len(entries) - start for entries, start in zip((load, update, store), before, strict=True)]
        counts.append([m, len(reaching), *added])

    sizes, of_pivots = _table(counts, 5), _table(pivots, 3)
    return {
        "elimination_size": sizes[:, 0].copy(),
        "elimination_width": sizes[:, 1].copy(),
        "elimination_loads": sizes[:, 2].copy(),
        "elimination_updates": sizes[:, 3].copy(),
        "elimination_stores": sizes[:, 4].copy(),
        "elimination_unknowns": of_pivots[:, 0].copy(),
        "elimination_below": of_pivots[:, 1].copy(),
        "elimination_across": of_pivots[:, 2].copy(),
        "elimination_lower": np.array(lower, dtype=np.int32),
        "elimination_upper": np.array(upper, dtype=np.int32),
        "elimination_load": _table(load, 2),
        "elimination_update": _table(update, 3),
        "elimination_store": _table(store, 2),
        "elimination_row": np.array([row for row, _ in result], dtype=np.int32),
        "elimination_column": np.array([column for _, column in result], dtype=np.int32),
    }


def compose(places: Positions, states: int, rows: int) -> dict[str, np.ndarray]:
    """Tables of `rumo_composition` for substeps that follow each other.

    Parameters
    ----------
    places : (row, column) pairs
        Of the entries of a substep's result [A | B | c]; none if an interval has but one substep.
    states, rows : int
        Size nx, and number of variables at the end.
    """
    entry = {place: e for e, place in enumerate(places) if place[0] < rows}
    found = set(entry)
    while True:  # until another substep adds no place
        reached = {(r, column) for r, i in entry if i < states for row, column in found if row == i}
        if reached <= found:
            break
        found |= reached
    order = sorted(found)
    composed = {place: e for e, place in enumerate(order)}
    counts: list[int] = []
    products: list[tuple[int, int]] = []
    for row, column in order:
        pairs = [
            (entry[row, i], composed[i, column]) for i in range(states) if (row, i) in entry and (i, column) in found
        ]
        counts.append(len(pairs))
        products += pairs
    start = [entry.get(place, -1) for place in order]
    own = [e if column >= states else -1 for (_, column), e in zip(order, start, strict=True)]
    places_of = _table(order, 2)
    return {
        "composition_row": places_of[:, 0].copy(),
        "composition_column": places_of[:, 1].copy(),
        "composition_start": np.array(start, dtype=np.int32),
        "composition_own": np.array(own, dtype=np.int32),
        "composition_products": np.array(counts, dtype=np.int32),
        "composition_product": _table(products, 2),
    }


def _table(values: Sequence[object], width: int) -> np.ndarray:
    return np.array(values, dtype=np.int32).reshape(-1, width)
