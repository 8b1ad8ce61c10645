"""The order and tables of elimination, run in NumPy, against a dense solution."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rumo.kernel.elimination import Equations, compose, eliminate
from rumo.kernel.factor import factor


def random_pattern(rng, nx, density):
    """A pattern whose matrix can be solved, though its diagonal may be empty."""
    return (rng.random((nx, nx)) < density) | np.eye(nx, dtype=bool)[rng.permutation(nx)]


def places(pattern):
    return [(int(row), int(column)) for row, column in np.argwhere(pattern)]


def block_matrix(tables, first, m, entries):
    """M of a block whose first pivot is known, from the entries of its factors before they are those of the factors."""
    below = tables["factor_below"][first : first + m]
    start = int(tables["factor_below"][:first].sum())
    later = tables["factor_later"][start : start + below.sum()]
    pivot = np.repeat(np.arange(m), below)
    M = np.diag(entries[:m])
    M[later, pivot], M[pivot, later] = np.split(entries[m:], 2)
    return M


def run(tables, terms, nx, nu):
    """What eliminate.c does with the tables, for one stage."""
    result = np.zeros(len(tables["elimination_row"]))
    load, update, store = (iter(tables[f"elimination_{name}"].tolist()) for name in ("load", "update", "store"))
    parts = ("size", "width", "sparse", "loads", "updates", "stores")
    first = 0
    for m, k, sparse, loads, updates, stores in zip(*(tables[f"elimination_{part}"] for part in parts), strict=True):
        fill = 2 * tables["factor_below"][first : first + m].sum() if sparse else 0
        work = np.zeros(m * k + m + fill if sparse else m * (m + k + 1))
        for _ in range(loads):
            slot, place = next(load)
            work[place] = terms[slot]
        for _ in range(updates):
            slot, entry, place = next(update)
            work[place] -= terms[slot] * result[entry]
        if sparse:
            right = work[: m * k].reshape(m, k)
            right[:] = np.linalg.solve(block_matrix(tables, first, m, work[m * k :]), right)
        else:
            dense = work.reshape(m, m + k + 1)
            dense[:, m : m + k] = np.linalg.solve(dense[:, :m], dense[:, m : m + k])
        for _ in range(stores):
            place, entry = next(store)
            result[entry] = work[place]
        first += m
    assert next(load, None) is next(update, None) is next(store, None) is None
    dense = np.zeros((nx, nx + nu + 1))
    dense[tables["elimination_row"], tables["elimination_column"]] = result
    return dense


@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    nx=st.integers(1, 25),
    nu=st.integers(1, 4),
    density=st.sampled_from([0.05, 0.1, 0.2, 0.8]),
)
def test_tables(seed, nx, nu, density):
    rng = np.random.default_rng(seed)
    patterns = {
        "M": random_pattern(rng, nx, density),
        "A0": rng.random((nx, nx)) < 0.4,
        "B": rng.random((nx, nu)) < 0.5,
    }
    positions = {name: places(pattern) for name, pattern in patterns.items()}
    first, slots = {"defect": 0}, nx
    for name, entries in positions.items():
        first[name], slots = slots, slots + len(entries)
    terms = rng.standard_normal(slots)
    dense = {}
    for name, pattern in patterns.items():
        dense[name] = np.zeros(pattern.shape)
        dense[name][pattern] = terms[first[name] : first[name] + len(positions[name])]

    equations = Equations(first, positions, nx, nx, nu)
    tables = eliminate(equations) | factor(equations.blocks, equations.left)
    assert all(table.dtype == np.int32 and table.flags.c_contiguous for table in tables.values())
    right = np.hstack([dense["A0"], dense["B"], terms[:nx, None]])
    if np.linalg.cond(dense["M"]) < 1e8:
        np.testing.assert_allclose(run(tables, terms, nx, nu), np.linalg.solve(dense["M"], right), rtol=1e-6, atol=1e-6)
    order = list(zip(tables["elimination_row"].tolist(), tables["elimination_column"].tolist(), strict=True))
    assert order == sorted(set(order)), "the result is sorted by rows, each entry once"


@settings(max_examples=100, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    nx=st.integers(1, 6),
    nz=st.integers(0, 2),
    density=st.sampled_from([0.1, 0.3, 0.9]),
    substeps=st.integers(1, 5),
)
def test_composition(seed, nx, nz, density, substeps):
    """Run the tables as compose.c does, against products of dense matrices."""
    rng = np.random.default_rng(seed)
    nu, rows = 2, nx + nz
    pattern = rng.random((rows + 3, nx + nu + 1)) < density  # three rows of inner unknowns have no part in it
    entries = places(pattern)
    tables = compose(entries, nx, rows)
    composed, total = None, None
    for _ in range(substeps):
        values = rng.standard_normal(len(entries))
        dense = np.zeros(pattern.shape)
        dense[pattern] = values
        A, rest = dense[:rows, :nx], dense[:rows, nx:]
        if total is None:
            composed = np.array([values[e] if e >= 0 else 0.0 for e in tables["composition_start"]])
            total = dense[:rows]
            continue
        total = np.hstack([A @ total[:nx, :nx], A @ total[:nx, nx:] + rest])
        product, after = iter(tables["composition_product"].tolist()), []
        for own, count in zip(tables["composition_own"], tables["composition_products"], strict=True):
            after.append(values[own] if own >= 0 else 0.0)
            for _ in range(count):
                a, b = next(product)
                after[-1] += values[a] * composed[b]
        assert next(product, None) is None
        composed = np.array(after)
    found = np.zeros_like(total)
    found[tables["composition_row"], tables["composition_column"]] = composed
    np.testing.assert_allclose(found, total, rtol=1e-12, atol=1e-12)


def test_no_composition_of_one_substep():
    assert all(table.size == 0 for table in compose([], 3, 3).values())
