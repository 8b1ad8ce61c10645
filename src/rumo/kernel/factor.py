"""How a substep's matrix is solved: block by block, each in an order of pivots found from its sparsity alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rumo.graphs import matching, minimum_degree, strong_components

MOST_PRODUCTS = 1_000_000
"""Of entries of the factors, in tables that have a number for each."""


class Block:
    """Unknowns that are solved for together.

    Attributes
    ----------
    equations, unknowns : list of int
        Where they meet are the pivots, none of them zero by structure.
    later : list of list of int
        For each pivot those in whose rows and columns there are entries below and right of it, in the factors.
    """

    def __init__(self, members: Sequence[int], rows: Sequence[Mapping[int, int]]) -> None:
        index = {s: i for i, s in enumerate(members)}
        inside = [[index[s] for s in rows[row] if s in index] for row in members]
        served = matching(inside)
        around: list[set[int]] = [set() for _ in members]
        for pivot, others in zip(served, inside, strict=True):
            for other in others:
                around[pivot].add(other)
                around[other].add(pivot)
        order, beneath = minimum_degree(around)
        position = {pivot: q for q, pivot in enumerate(order)}
        equation_of = dict(zip(served, members, strict=True))
        self.equations = [equation_of[pivot] for pivot in order]
        self.unknowns = [members[pivot] for pivot in order]
        self.later = [sorted(position[pivot] for pivot in pivots) for pivots in beneath]

    def entries(self) -> dict[tuple[int, int], int]:
        """Numbers of the entries of the factors: pivots, those below each of them, those right of each of them."""
        places = [(q, q) for q in range(len(self.later))]
        places += [(i, q) for q, rows in enumerate(self.later) for i in rows]
        places += [(q, j) for q, columns in enumerate(self.later) for j in columns]
        return {place: e for e, place in enumerate(places)}

    @property
    def fill(self) -> int:
        """Entries of the factors."""
        return len(self.later) + 2 * sum(map(len, self.later))

    @property
    def products(self) -> int:
        """Multiplications that it takes to factor."""
        return sum(len(rows) * (len(rows) + 1) for rows in self.later)

    def pays(self, columns: int) -> bool:
        """Whether sparse factors take less than half the multiplications of dense ones, solving for so many columns."""
        m = len(self.later)
        return 2 * (self.products + self.fill * columns) < m**2 * (m / 3 + columns)


def blocks_of(rows: Sequence[Mapping[int, int]]) -> list[Block]:
    """Blocks of a matrix with these rows (column to slot), each depending on earlier ones only."""
    return [Block(members, rows) for members in strong_components(rows)]


def factor(blocks: Sequence[Block], rows: Sequence[Mapping[int, int]]) -> dict[str, np.ndarray]:
    """Tables of `rumo_factor` for a matrix with these rows (column to slot); those of no blocks if given none."""
    equations = [row for block in blocks for row in block.equations]
    unknowns = [s for block in blocks for s in block.unknowns]
    later = [pivots for block in blocks for pivots in block.later]
    row_of, column_of = ({s: q for q, s in enumerate(order)} for order in (equations, unknowns))
    target: list[int] = []
    inside: list[tuple[int, int, int]] = []  # slot, row, column
    outside: list[tuple[int, int, int]] = []
    places: list[int] = []
    start = count = 0
    for block in blocks:
        entry = block.entries()
        for pivots in block.later:
            target += [entry[i, j] for i in pivots for j in pivots]
        for row in block.equations:
            i = row_of[row]
            for column, slot in rows[row].items():
                j = column_of[column]
                if j >= start:
                    inside.append((slot, i, j))
                    places.append(count + entry[i - start, j - start])
                else:
                    outside.append((slot, i, j))
        start += len(block.later)
        count += len(entry)
    return {
        "factor_size": _ints([len(block.later) for block in blocks]),
        "factor_equation": _ints(equations),
        "factor_unknown": _ints(unknowns),
        "factor_below": _ints([len(pivots) for pivots in later]),
        "factor_later": _ints([i for pivots in later for i in pivots]),
        "factor_target": _ints(target),
        "factor_nonzero": _ints(outside + inside).reshape(-1, 3),
        "factor_entry": _ints(places),
    }


def _ints(values: Sequence[object]) -> np.ndarray:
    return np.array(values, dtype=np.int32)
