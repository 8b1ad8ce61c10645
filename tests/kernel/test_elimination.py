"""The order and tables of elimination, run in NumPy, against a dense solution."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rumo.kernel.elimination import LARGE, Equations, compose, eliminate
from rumo.kernel.factor import factor
from rumo.kernel.pivots import STEADY, balanced, pivot_order


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
    load, update, store, below, across, lower, upper = (
        iter(tables[f"elimination_{name}"].tolist())
        for name in ("load", "update", "store", "below", "across", "lower", "upper")
    )
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
        around = [
            [[next(rows) for _ in range(next(counts))] for rows, counts in ((lower, below), (upper, across))]
            for _ in range(m)
        ]
        if sparse:
            right = work[: m * k].reshape(m, k)
            right[:] = np.linalg.solve(block_matrix(tables, first, m, work[m * k :]), right)
        else:
            solve_in_order(work.reshape(m, m + k + 1), around)
        for _ in range(stores):
            place, entry = next(store)
            result[entry] = work[place]
        first += m
    assert all(next(left, None) is None for left in (load, update, store, below, across, lower, upper))
    dense = np.zeros((nx, nx + nu + 1))
    dense[tables["elimination_row"], tables["elimination_column"]] = result
    return dense


def solve_in_order(work, around):
    """Solve a block in place; `around` has what is not zero below each pivot, and right of it."""
    m = len(work)
    for p, (under, beside) in enumerate(around):
        work[p, beside] /= work[p, p]
        work[np.ix_(under, beside)] -= np.outer(work[under, p], work[p, beside])
    for p in reversed(range(m)):
        for j in (j for j in around[p][1] if j < m):
            work[p, m:-1] -= work[p, j] * work[j, m:-1]


@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    nx=st.integers(1, 25),
    nu=st.integers(1, 4),
    density=st.sampled_from([0.05, 0.1, 0.2, 0.8]),
    sparse=st.booleans(),
)
def test_tables(seed, nx, nu, density, sparse):
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
    equations.sparse = [sparse and len(block.unknowns) > 1 for block in equations.blocks]
    tables = eliminate(equations, lambda: dense["M"][None]) | factor(equations.blocks, equations.left)
    assert all(table.dtype == np.int32 and table.flags.c_contiguous for table in tables.values())
    right = np.hstack([dense["A0"], dense["B"], terms[:nx, None]])
    if np.linalg.cond(dense["M"]) < 1e8:
        np.testing.assert_allclose(run(tables, terms, nx, nu), np.linalg.solve(dense["M"], right), rtol=1e-6, atol=1e-6)
    order = list(zip(tables["elimination_row"].tolist(), tables["elimination_column"].tolist(), strict=True))
    assert order == sorted(set(order)), "the result is sorted by rows, each entry once"


@settings(max_examples=200, deadline=None)
@example(seed=229, n=6, points=1, density=0.3, spread=150.0)  # no units balance it
@given(
    seed=st.integers(0, 10**6),
    n=st.integers(1, 12),
    points=st.integers(0, 3),
    density=st.sampled_from([0.1, 0.3, 0.9]),
    spread=st.sampled_from([0.0, 2.0, 150.0]),
)
def test_pivots_of_any_matrix(seed, n, points, density, spread):
    rng = np.random.default_rng(seed)
    pattern = rng.random((n, n)) < density  # it may have no solution
    rows, columns = pivot_order(pattern, rng.standard_normal((points, n, n)) * 10.0 ** rng.uniform(-spread, spread, n))
    assert sorted(rows) == sorted(columns) == list(range(n))


@pytest.mark.parametrize("seed", range(20))
def test_pivots_are_no_small_ones(seed):
    """Eliminated without exchanges, no entry below a pivot is much larger, in units in which the matrix is balanced."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 12))
    pattern = random_pattern(rng, n, 0.4)
    unit = 10.0 ** rng.uniform(-3.0, 3.0, n)
    M = np.where(pattern, rng.standard_normal((n, n)), 0.0) * unit[:, None] / unit
    rows, columns = pivot_order(pattern, M[None])
    work = balanced(M[None])[0][np.ix_(rows, columns)]
    for p in range(n - 1):
        assert np.abs(work[p + 1 :, p]).max() <= np.abs(work[p, p]) / STEADY * (1.0 + 1e-9)
        work[p + 1 :, p:] -= np.outer(work[p + 1 :, p] / work[p, p], work[p, p:])


def test_stiff_unknowns_first():
    """Two fast states, which drive two slow ones and are driven by them; found at most points, not at all."""
    M = np.array([[4.0, 2.0, -1.0, 0.5], [2.0, 4.0, 0.5, -1.0], [-4e3, 20.0, 4e3, 0.0], [30.0, -4e3, 0.0, 4e3]])
    rows, columns = pivot_order(M != 0.0, np.array([M, M, np.ones((4, 4))]))
    assert rows == columns
    assert set(rows[:2]) == {2, 3}


@pytest.mark.parametrize("n", [30, LARGE + 1])
def test_no_fill_where_it_can_be_avoided(n):
    pattern = np.eye(n, dtype=bool) | np.eye(n, k=1, dtype=bool) | np.eye(n, k=-1, dtype=bool)
    equations = Equations({"defect": 0, "M": n, "A0": 0, "B": 0}, {"M": places(pattern), "A0": [], "B": []}, n, n, 1)
    equations.sparse = [False]
    tables = eliminate(equations, lambda: np.where(pattern, 1.0 + 2.0 * np.eye(n), 0.0)[None])
    assert len(tables["elimination_lower"]) == n - 1


@pytest.mark.parametrize(("n", "sparse"), [(LARGE, False), (LARGE + 1, True)])
def test_sparse_factors_of_large_blocks(n, sparse):
    pattern = np.eye(n, dtype=bool) | np.eye(n, k=1, dtype=bool) | np.eye(n, k=-1, dtype=bool)
    first, positions = {"defect": 0, "M": n, "A0": 0, "B": 0}, {"M": places(pattern), "A0": [], "B": []}
    assert Equations(first, positions, n, n, 1).sparse == [sparse]


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
