"""Graphs of sparsity patterns, against SciPy's and CasADi's."""

import casadi as ca
import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_bipartite_matching

from rumo.graphs import matching, minimum_degree, reachable, strong_components

seeds = pytest.mark.parametrize("seed", range(40))


def random_pattern(seed, largest=30):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, largest))
    return rng, rng.random((n, n)) < rng.choice([0.5, 1.0, 2.0, 5.0]) / n


def neighbours(pattern):
    return [np.flatnonzero(row).tolist() for row in pattern]


@seeds
def test_reachable(seed):
    rng, pattern = random_pattern(seed)
    starts = rng.choice(len(pattern), size=min(2, len(pattern)), replace=False)
    graph = csr_array(pattern * 1.0)
    expected = {int(node) for start in starts for node in breadth_first_order(graph, start, return_predecessors=False)}
    assert reachable(neighbours(pattern), starts.tolist()) == expected


@seeds
def test_strong_components(seed):
    _, pattern = random_pattern(seed)
    groups = strong_components(neighbours(pattern))
    count, labels = connected_components(csr_array(pattern * 1.0), connection="strong")
    assert sorted(groups) == sorted(np.flatnonzero(labels == label).tolist() for label in range(count))
    done: set[int] = set()
    for group in groups:
        reached = {int(s) for node in group for s in np.flatnonzero(pattern[node])} - set(group)
        assert reached <= done, "a group comes after those it reaches"
        done |= set(group)


def test_a_long_chain_needs_no_recursion():
    ring = [[(node + 1) % 5000] for node in range(5000)]
    assert strong_components(ring) == [list(range(5000))]


@seeds
def test_matching(seed):
    _, pattern = random_pattern(seed)
    unknowns = matching(neighbours(pattern))
    assert sorted(unknowns) == list(range(len(pattern)))
    served = sum(pattern[equation, unknown] for equation, unknown in enumerate(unknowns))
    assert served == (maximum_bipartite_matching(csr_array(pattern * 1.0)) >= 0).sum()
    np.fill_diagonal(pattern, True)
    assert matching(neighbours(pattern)) == list(range(len(pattern)))


def grid(width, height):
    """Five-point stencil."""
    nodes = np.arange(width * height).reshape(height, width)
    pattern = np.eye(width * height, dtype=bool)
    for a, b in ((nodes[1:], nodes[:-1]), (nodes[:, 1:], nodes[:, :-1])):
        pattern[a, b] = pattern[b, a] = True
    return pattern


def with_hub(pattern):
    """One more node, a neighbour of all: the first."""
    return np.pad(pattern, ((1, 0), (1, 0)), constant_values=True)


@pytest.mark.parametrize(
    "pattern",
    [grid(1, 50), grid(12, 12), grid(3, 40), with_hub(grid(1, 50)), np.ones((20, 20), dtype=bool)]
    + [pattern | pattern.T for _, pattern in map(random_pattern, range(20))],
)
def test_minimum_degree(pattern):
    order, later = minimum_degree(neighbours(pattern))
    n = len(pattern)
    assert sorted(order) == list(range(n))
    filled = pattern[np.ix_(order, order)] | np.eye(n, dtype=bool)
    for p in range(n):  # eliminate, and count what is there
        below = np.flatnonzero(filled[p + 1 :, p]) + p + 1
        assert {order[i] for i in below} == later[p]
        filled[np.ix_(below, below)] = True
    # Approximate minimum degree by another hand, and the fill of its order.
    sparsity = ca.DM(csr_array((pattern | np.eye(n, dtype=bool)) * 1.0)).sparsity()
    other = sparsity.amd()
    permuted = pattern[np.ix_(other, other)] | np.eye(n, dtype=bool)
    for p in range(n):
        below = np.flatnonzero(permuted[p + 1 :, p]) + p + 1
        permuted[np.ix_(below, below)] = True
    assert filled.sum() <= 1.2 * permuted.sum()
