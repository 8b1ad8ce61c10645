"""Elimination and composition as straight-line C: what loops over tables do, for one problem, without the zeros."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

LIMIT = 4000
"""Products above which there is no such code: compilers take many seconds for it."""


def elimination_source(tables: Mapping[str, Any], name: str, horizon: int) -> str:
    """The function `eliminate_in_order` of eliminate.c for one problem, written so that it becomes vector instructions.

    Parameters
    ----------
    tables : mapping of str to ndarray
        Of `rumo_elimination`, as `eliminate` makes them.
    name : str
        Of the function.
    horizon : int
        Number N of stages.
    """
    arguments = [
        "double patience",
        "const double *restrict terms",
        "double *restrict result",
        "double *restrict lack",
    ]
    in_order = len(tables["elimination_size"]) and not tables["elimination_sparse"].any()
    if not in_order or _products(tables) > LIMIT:
        return _function(name, arguments, [], horizon)
    statements = [
        "double worst = 0.0, odd0 = 0.0, odd1 = 0.0, odd2 = 0.0, odd3 = 0.0;",
        *_Writer(tables).statements(),
        "lack[k] = worst + ((odd0 + odd1) + (odd2 + odd3));",
    ]
    return _function(name, arguments, statements, horizon)


def _products(tables: Mapping[str, Any]) -> int:
    """How many multiplications there are, about: those of the pivots, of the rest, and of the substitution back."""
    below, across = tables["elimination_below"], tables["elimination_across"]
    width = [k for m, k in zip(tables["elimination_size"], tables["elimination_width"], strict=True) for _ in range(m)]
    return int(((below + 1) * across + across * width).sum()) + len(tables["elimination_update"])


def composition_source(tables: Mapping[str, Any], name: str, horizon: int) -> str:
    """The function `compose_in_code` of compose.c for one problem, written so that it becomes vector instructions.

    Parameters
    ----------
    tables : mapping of str to ndarray
        Of `rumo_composition`, as `compose` makes them.
    name : str
        Of the function.
    horizon : int
        Number N of stages.
    """
    arguments = ["const double *restrict result", "const double *restrict before", "double *restrict after"]
    if not 0 < len(tables["composition_product"]) <= LIMIT:
        return _function(name, arguments, [], horizon)
    product = iter(tables["composition_product"].tolist())
    statements: list[str] = []
    for e, (own, count) in enumerate(zip(tables["composition_own"], tables["composition_products"], strict=True)):
        terms = [f"result[{own} * LANES_ALL + k]"] if own >= 0 else []
        pairs = [next(product) for _ in range(count)]
        terms += [f"result[{a} * LANES_ALL + k] * before[{b} * LANES_ALL + k]" for a, b in pairs]
        statements.append(f"after[{e} * LANES_ALL + k] = {' + '.join(terms) or '0.0'};")
    return _function(name, arguments, statements, horizon)


def _function(name: str, arguments: Sequence[str], statements: Sequence[str], horizon: int) -> str:
    """A function in C of statements for each stage, k, that returns whether there are any."""
    body = "return 0;"
    if statements:
        inner = "\n        ".join(statements)
        body = f"""\
enum {{ LANES_ALL = ({horizon} + LANES - 1) / LANES * LANES }};
    for (int k = 0; k < LANES_ALL; ++k) {{
        {inner}
    }}
    return 1;"""
    return f"""\
static int {name}({", ".join(arguments)}) {{
    {", ".join(f"(void){argument.split()[-1]}" for argument in arguments)};
    {body}
}}
"""


class _Writer:
    """Statements for one stage, k; what is not zero is a local variable."""

    def __init__(self, tables: Mapping[str, Any]) -> None:
        self._tables = {name.removeprefix("elimination_"): values for name, values in tables.items()}
        self._parts = {
            name: iter(self._tables[name].tolist()) for name in ("load", "update", "store", "lower", "upper")
        }
        self._entry: dict[int, str] = {}  # variable of each entry of the result that is known

    def _next(self, part: str, count: int) -> list[Any]:
        return [next(self._parts[part]) for _ in range(count)]

    def statements(self) -> Iterator[str]:
        names = ("size", "width", "loads", "updates", "stores")
        start = 0
        for b, counts in enumerate(zip(*(self._tables[name].tolist() for name in names), strict=True)):
            yield from self._block(b, start, *counts)
            start += counts[0]

    def _block(self, b: int, start: int, m: int, k: int, loads: int, updates: int, stores: int) -> Iterator[str]:
        known: dict[tuple[int, int], str] = {}

        def add(place: tuple[int, int], sign: str, value: str) -> str:
            if place in known:
                return f"{known[place]} {sign}= {value};"
            known[place] = f"w{b}_{place[0]}_{place[1]}"
            return f"double {known[place]} = {sign.replace('+', '')}{value};"

        for slot, place in self._next("load", loads):
            yield add(divmod(place, m + k + 1), "+", f"terms[{slot} * LANES_ALL + k]")
        for slot, entry, place in self._next("update", updates):
            yield add(divmod(place, m + k + 1), "-", f"terms[{slot} * LANES_ALL + k] * {self._entry[entry]}")

        below, across = (self._tables[name][start : start + m].tolist() for name in ("below", "across"))
        right: list[list[int]] = []
        for p in range(m):
            lower = self._next("lower", below[p])
            right.append(self._next("upper", across[p]))
            if right[p]:
                yield f"const double i{b}_{p} = 1.0 / {known[p, p]};"
            for j in right[p]:
                yield f"{known[p, j]} *= i{b}_{p};"
            for i in lower:
                if (p, i) in known:
                    change, pivot = f"fabs({known[i, p]} * {known[p, i]})", known.get((i, i), "0.0")
                    yield f"worst = larger(worst, {change} - patience * fabs({pivot}));"
                for j in right[p]:
                    yield add((i, j), "-", f"{known[i, p]} * {known[p, j]}")
        for p in reversed(range(m)):
            for i in (i for i in right[p] if i < m):
                for j in range(m, m + k):
                    if (i, j) in known:
                        yield add((p, j), "-", f"{known[p, i]} * {known[i, j]}")
        for place, entry in self._next("store", stores):
            i, j = divmod(place, m + k + 1)
            self._entry[entry] = known.get((i, j), "0.0")
            yield f"result[{entry} * LANES_ALL + k] = {self._entry[entry]};"
            if (i, j) in known:
                yield f"odd{entry % 4} += 0.0 * {known[i, j]};"
