"""The order in which a step's unknowns are solved for, and how steps are put together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rumo.kernel.factor import MOST_PRODUCTS, Block, blocks_of
from rumo.kernel.pivots import pivot_order
from rumo.signals import Array

Positions = Sequence[tuple[int, int]]
"""(row, column) of the structural nonzeros of a matrix, sorted by rows."""


LANES = 8
"""Columns that are computed together."""
LARGE = 48
"""Unknowns of a block above which an order of pivots is found from its pattern alone: from numbers it takes seconds."""


class Equations:
    """`M dw = A0 dx + B du + defect` by rows, in blocks of M in triangular order.

    Parameters
    ----------
    first : mapping of str to int
        Slot of the first term of each of M, A0, B, defect.
    positions : mapping of str to (row, column) pairs
        Nonzeros of M, A0 and B.
    unknowns, states, inputs : int
        Sizes nw, nx and nu.

    Attributes
    ----------
    left, right : list of dict
        Rows of M and of [A0 | B | defect], column to slot.
    blocks : list of Block
        Each depends on earlier ones only.
    columns : list of list of int
        Of [A0 | B | defect], those that reach each block.
    sparse : list of bool
        Which blocks are solved by sparse factors.
    """

    def __init__(
        self, first: Mapping[str, int], positions: Mapping[str, Positions], unknowns: int, states: int, inputs: int
    ) -> None:
        self.left: list[dict[int, int]] = [{} for _ in range(unknowns)]
        self.right = [{states + inputs: first["defect"] + r} for r in range(unknowns)]
        for name, rows, offset in (("M", self.left, 0), ("A0", self.right, 0), ("B", self.right, states)):
            for e, (row, column) in enumerate(positions[name]):
                rows[row][offset + column] = first[name] + e
        self.blocks = blocks_of(self.left)
        reaching: dict[int, list[int]] = {}
        for block in self.blocks:
            found = {column for row in block.equations for column in self.right[row]}
            found.update(*({*reaching[s]} for row in block.equations for s in self.left[row] if s in reaching))
            reaching |= dict.fromkeys(block.unknowns, sorted(found))
        self.columns = [reaching[block.unknowns[0]] for block in self.blocks]
        few = sum(block.products for block in self.blocks) <= MOST_PRODUCTS
        self.sparse = [
            few and len(block.unknowns) > LARGE and block.pays(len(c))
            for block, c in zip(self.blocks, self.columns, strict=True)
        ]

    def pivots_of(self, block: Block, samples: Callable[[], Array]) -> tuple[list[int], list[int]]:
        """Rows and columns of a block in the order in which they become pivots; `samples` as `eliminate` has it."""
        if len(block.unknowns) == 1 or len(block.unknowns) > LARGE:
            return block.equations, block.unknowns
        members = sorted(block.unknowns)
        pattern = np.array([[s in self.left[row] for s in members] for row in members])
        order = pivot_order(pattern, samples()[:, np.array(members)[:, None], members])
        rows, solved = ([members[i] for i in part] for part in order)
        return rows, solved

    def wide(self, rows: int, free: int) -> bool:
        """Whether condensing is faster with the equations themselves than with their result.

        Parameters
        ----------
        rows : int
            Variables at the end, the first of the unknowns.
        free : int
            Free inputs on the horizon; on average, half of them act before a stage.

        Notes
        -----
        By times measured per stage, in 0.1 ns: an entry of the equations takes 5 for each column of responses and 60 in
        the two sweeps of a feedback; an entry of the result 1 and 4; elimination 9 for each column and entry of sparse
        factors, 1.5 for each multiplication of dense ones. Dense blocks leave out what is zero as well.
        """
        if sum(block.products for block in self.blocks) > MOST_PRODUCTS:
            return False
        columns = free / 2 + LANES / 2
        entries = sum(block.fill for block in self.blocks) + sum(map(len, self.left)) + sum(map(len, self.right))
        result = eliminated = 0.0
        for block, reaching in zip(self.blocks, self.columns, strict=True):
            m, k = len(block.unknowns), len(reaching)
            result += k * sum(unknown < rows for unknown in block.unknowns)
            eliminated += min(9 * block.fill * k, 1.5 * m**2 * (m / 3 + k))
        return entries * (5 * columns + 60) < result * (columns + 4) + eliminated


def eliminate(equations: Equations, samples: Callable[[], Array]) -> dict[str, np.ndarray]:
    """Tables of `rumo_elimination`.

    Parameters
    ----------
    equations : Equations
        What is solved.
    samples : callable
        M (points, nw, nw) at some points, for the order of pivots inside the blocks.
    """
    left, right = equations.left, equations.right
    columns = {s: c for block, c in zip(equations.blocks, equations.columns, strict=True) for s in block.unknowns}
    result = {place: e for e, place in enumerate((r, c) for r in range(len(left)) for c in columns[r])}

    load: list[tuple[int, int]] = []
    update: list[tuple[int, int, int]] = []
    store: list[tuple[int, int]] = []
    lower: list[int] = []
    upper: list[int] = []
    counts: list[list[int]] = []
    pivots: list[tuple[int, int]] = []
    for block, reaching, sparse in zip(equations.blocks, equations.columns, equations.sparse, strict=True):
        m, k = len(block.unknowns), len(reaching)
        before = len(load), len(update), len(store)
        rows, solved = (block.equations, block.unknowns) if sparse else equations.pivots_of(block, samples)
        position = {s: j for j, s in enumerate(solved)}
        entry = block.entries() if sparse else {}
        for i, (row, unknown) in enumerate(zip(rows, solved, strict=True)):
            # Where the work has row i of M, and its right-hand side.
            start = i * k if sparse else i * (m + k + 1) + m
            place = {column: start + j for j, column in enumerate(reaching)}
            for s, slot in left[row].items():
                if s in position:
                    load.append((slot, m * k + entry[i, position[s]] if sparse else start - m + position[s]))
                else:
                    update += [(slot, result[s, column], place[column]) for column in columns[s]]
            load += [(slot, place[column]) for column, slot in right[row].items()]
            store += [(place[column], result[unknown, column]) for column in reaching]
        added = [len(entries) - start for entries, start in zip((load, update, store), before, strict=True)]
        counts.append([m, k, int(sparse), *added])
        if sparse:
            pivots += [(0, 0)] * m
            continue
        nonzero = np.zeros((m, m + k + 1), dtype=bool)
        nonzero.flat[[at for *_, at in (*load[before[0] :], *update[before[1] :])]] = True
        for p in range(m):
            below, across = np.flatnonzero(nonzero[p + 1 :, p]) + p + 1, np.flatnonzero(nonzero[p, p + 1 :]) + p + 1
            nonzero[np.ix_(below, across)] = True
            pivots.append((len(below), len(across)))
            lower += below.tolist()
            upper += across.tolist()
    return _elimination(counts, pivots, (lower, upper), load, update, store, list(result))


def nothing_eliminated(unknowns: int) -> dict[str, np.ndarray]:
    """Tables of `rumo_elimination` where the equations themselves are solved."""
    return _elimination([], [(0, 0)] * unknowns, ([], []), [], [], [], [])


def _elimination(
    counts: Sequence[object],
    pivots: Sequence[object],
    nonzero: tuple[Sequence[int], Sequence[int]],
    load: Sequence[object],
    update: Sequence[object],
    store: Sequence[object],
    places: Positions,
) -> dict[str, np.ndarray]:
    names = ("size", "width", "sparse", "loads", "updates", "stores")
    parts = {name: _table(counts, 6)[:, i].copy() for i, name in enumerate(names)}
    parts |= {name: _table(pivots, 2)[:, i].copy() for i, name in enumerate(("below", "across"))}
    parts |= {name: np.array(of, dtype=np.int32) for name, of in zip(("lower", "upper"), nonzero, strict=True)}
    parts |= {"load": _table(load, 2), "update": _table(update, 3), "store": _table(store, 2)}
    parts |= {name: _table(places, 2)[:, i].copy() for i, name in enumerate(("row", "column"))}
    return {f"elimination_{name}": part for name, part in parts.items()}


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
