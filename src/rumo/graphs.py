"""Graphs as lists of neighbours: what a sparsity pattern says about the order in which equations are solved."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from heapq import heapify, heappop, heappush

Neighbours = Sequence[Collection[int]]


def reachable(neighbours: Neighbours, seeds: Iterable[int]) -> set[int]:
    """All nodes that a path leads to from one of the seeds, which belong to them."""
    found = set(seeds)
    waiting = list(found)
    while waiting:
        new = set(neighbours[waiting.pop()]) - found
        found |= new
        waiting += new
    return found


def strong_components(neighbours: Neighbours) -> list[list[int]]:
    """Groups of nodes that reach each other, sorted; each group comes after all others that it reaches.

    Source: Tarjan (1972), without recursion.
    """
    number: dict[int, int] = {}  # in the order of visits
    lowest: dict[int, int] = {}  # number of a node on the way here that is reached from here
    grouped: set[int] = set()
    waiting: list[int] = []
    groups: list[list[int]] = []
    for root in range(len(neighbours)):
        if root in number:
            continue
        path, others = [root], {root: iter(neighbours[root])}
        while path:
            node = path[-1]
            if node not in number:
                number[node] = lowest[node] = len(number)
                waiting.append(node)
            for other in others[node]:
                if other not in number:
                    path.append(other)
                    others[other] = iter(neighbours[other])
                    break
                if other not in grouped:
                    lowest[node] = min(lowest[node], number[other])
            else:
                path.pop()
                if path:
                    lowest[path[-1]] = min(lowest[path[-1]], lowest[node])
                if lowest[node] == number[node]:
                    group = [waiting.pop()]
                    while group[-1] != node:
                        group.append(waiting.pop())
                    grouped.update(group)
                    groups.append(sorted(group))
    return groups


def matching(neighbours: Neighbours) -> list[int]:
    """An unknown for each equation, no two the same, among those that enter it; its own where all can be served so.

    Equations that get none, if the pattern is singular, share what is left. Augmenting paths, as in Duff (1981).
    """
    count = len(neighbours)
    unknown_of = {i: i for i in range(count) if i in neighbours[i]}
    equation_of = dict(unknown_of)
    for start in [i for i in range(count) if i not in unknown_of]:
        found_from: dict[int, int] = {}
        waiting, free = [start], None
        while waiting and free is None:
            equation = waiting.pop()
            for unknown in neighbours[equation]:
                if unknown not in found_from:
                    found_from[unknown] = equation
                    if unknown not in equation_of:
                        free = unknown
                        break
                    waiting.append(equation_of[unknown])
        while free is not None:  # everyone on the path moves on by one
            equation = equation_of[free] = found_from[free]
            unknown_of[equation], free = free, unknown_of.get(equation)
    left = iter(sorted(set(range(count)) - set(unknown_of.values())))
    return [unknown_of[i] if i in unknown_of else next(left) for i in range(count)]


def minimum_degree(neighbours: Neighbours) -> tuple[list[int], list[set[int]]]:
    """An order in which eliminating the nodes of an undirected graph adds few edges.

    Returns
    -------
    order : list of int
        All nodes.
    later : list of set of int
        For each of them, in that order, its neighbours when its turn comes: all of them come later.

    Notes
    -----
    Source: Tinney and Walker (1967), their second scheme.
    """
    around = [set(others) - {node} for node, others in enumerate(neighbours)]
    queue = [(len(others), node) for node, others in enumerate(around)]
    heapify(queue)
    left = set(range(len(around)))
    order: list[int] = []
    later: list[set[int]] = []
    while queue:
        degree, node = heappop(queue)
        if node not in left or degree != len(around[node]):
            continue
        if degree == len(left) - 1:  # all that are left are neighbours of each other
            while left:
                order.append(min(left))
                left.remove(order[-1])
                later.append(set(left))
            break
        order.append(node)
        later.append(around[node])
        left.remove(node)
        for other in around[node]:
            around[other] |= around[node]
            around[other] -= {node, other}
            heappush(queue, (len(around[other]), other))
    return order, later
