"""The order in which a step's unknowns are solved for, and how steps are put together, from sparsity patterns alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rumo.graphs import strong_components

Positions = Sequence[tuple[int, int]]
"""(row, column) of the structural nonzeros of a matrix, sorted by rows."""


def eliminate(
    first: Mapping[str, int], positions: Mapping[str, Positions], unknowns: int, states: int, inputs: int
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
    """
    constant = states + inputs
    left: list[dict[int, int]] = [{} for _ in range(unknowns)]
    for e, (row, column) in enumerate(positions["M"]):
        left[row][column] = first["M"] + e
    right: list[dict[int, int]] = [{constant: first["defect"] + r} for r in range(unknowns)]
    for e, (row, column) in enumerate(positions["A0"]):
        right[row][column] = first["A0"] + e
    for e, (row, column) in enumerate(positions["B"]):
        right[row][states + column] = first["B"] + e

    blocks = strong_components(left)
    columns: dict[int, list[int]] = {}
    for block in blocks:
        reaching = {column for row in block for column in right[row]}
        reaching.update(*({*columns[s]} for row in block for s in left[row] if s in columns))
        columns |= dict.fromkeys(block, sorted(reaching))
    result = {place: e for e, place in enumerate((r, c) for r in range(unknowns) for c in columns[r])}

    load: list[tuple[int, int]] = []
    update: list[tuple[int, int, int]] = []
    store: list[tuple[int, int]] = []
    counts: list[list[int]] = []
    for block in blocks:
        m, reaching = len(block), columns[block[0]]
        position = {s: j for j, s in enumerate(block)}
        before = len(load), len(update), len(store)
        for i, row in enumerate(block):
            start = i * (m + len(reaching) + 1)
            place = {column: start + m + j for j, column in enumerate(reaching)}
            load += [(slot, start + position[s]) for s, slot in left[row].items() if s in position]
            load += [(slot, place[column]) for column, slot in sorted(right[row].items())]
            for s, slot in left[row].items():
                if s not in position:
                    update += [(slot, result[s, column], place[column]) for column in columns[s]]
            store += [(place[column], result[row, column]) for column in reaching]
        added = [len(entries) - start for entries, start in zip((load, update, store), before, strict=True)]
        counts.append([m, len(reaching), *added])

    sizes = _table(counts, 5)
    return {
        "elimination_size": sizes[:, 0].copy(),
        "elimination_width": sizes[:, 1].copy(),
        "elimination_loads": sizes[:, 2].copy(),
        "elimination_updates": sizes[:, 3].copy(),
        "elimination_stores": sizes[:, 4].copy(),
        "elimination_unknowns": np.array([s for block in blocks for s in block], dtype=np.int32),
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
    A: list[list[int]] = [[] for _ in range(rows)]
    found: list[set[int]] = [set() for _ in range(rows)]
    for row, column in entry:
        found[row].add(column)
        if column < states:
            A[row].append(column)
    count = 0
    while count < (count := sum(map(len, found))):  # until another substep adds no place
        before = [set(columns) for columns in found[:states]]
        for row in range(rows):
            found[row].update(*(before[i] for i in A[row]))
    order = [(row, column) for row in range(rows) for column in sorted(found[row])]
    composed = {place: e for e, place in enumerate(order)}
    counts: list[int] = []
    products: list[tuple[int, int]] = []
    for row, column in order:
        pairs = [(entry[row, i], composed[i, column]) for i in A[row] if column in found[i]]
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
