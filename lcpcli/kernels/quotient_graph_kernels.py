"""An order of elimination with little fill-in for sparse symmetric matrices, compiled by numba.

Approximate minimum degree: P. R. Amestoy, T. A. Davis, I. S. Duff, An approximate minimum degree ordering algorithm,
SIAM J. Matrix Anal. Appl. 17 (1996) 886-905. Eliminated variables become elements of a quotient graph: the list of a
variable has the elements that it belongs to, and then the variables that it is adjacent to through entries of the
matrix; the list of an element has its variables. Variables with the same lists are merged, and count with their number.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from lcpcli.kernels.ldl_kernels import borrowing, compiled

NONE = -1
OWNED = -2  # minus the owner of a list: its first entry while lists are moved


class Graph(NamedTuple):
    """A quotient graph on n variables.

    lists : all lists one after another, with room; used[0] : where the free room begins. begin, length : of each list.
    elements : how many elements the list of a variable begins with.
    size : how many variables a variable stands for, 0 after it is merged or eliminated; 1 of an element that is alive.
    degree : of a variable, a bound on its external degree; of an element, the number of its variables.
    head, next, previous : for each degree, the variables with it.
    follower, last : the variables merged into each, as a chain.
    mark : for elements and variables, when they were last met.
    """

    lists: Any
    used: Any
    begin: Any
    length: Any
    elements: Any
    size: Any
    degree: Any
    head: Any
    next: Any
    previous: Any
    follower: Any
    last: Any
    mark: Any


@borrowing
def _insert(head: Any, after: Any, previous: Any, d: int, i: int) -> None:
    """Add a variable to those of its degree d."""
    first = head[d]
    after[i], previous[i], head[d] = first, NONE, i
    if first != NONE:
        previous[first] = i


@borrowing
def _remove(head: Any, after: Any, previous: Any, d: int, i: int) -> None:
    """Remove a variable from those of its degree d."""
    before, behind = previous[i], after[i]
    if before == NONE:
        head[d] = behind
    else:
        after[before] = behind
    if behind != NONE:
        previous[behind] = before


@borrowing
def _append(graph: Any, i: int, j: int) -> None:
    """Let variable i stand for what j stands for too, which is eliminated right after it."""
    graph.follower[graph.last[i]] = j
    graph.last[i] = graph.last[j]
    graph.size[j] = 0


@borrowing
def _compress(graph: Any, first: Any) -> None:
    """Move all lists together; first : n places for work."""
    lists, begin, length = graph.lists, graph.begin, graph.length
    for i in range(begin.size):
        if length[i] > 0:  # its first entry makes room for its owner
            first[i], lists[begin[i]] = lists[begin[i]], OWNED - i
    p, end = 0, 0
    while p < graph.used[0]:
        i = OWNED - lists[p]
        p += 1
        if i >= 0:
            lists[end] = first[i]
            for t in range(1, length[i]):
                lists[end + t] = lists[p + t - 1]
            p += length[i] - 1
            begin[i], end = end, end + length[i]
    graph.used[0] = end


@borrowing
def _eliminate(graph: Any, pivot: int, stamp: int, work: Any) -> int:
    """Make an element of a variable: its list becomes all that it is adjacent to, directly or through its elements,
    which it absorbs. Return the number of these variables, each as many as it stands for."""
    needed = graph.length[pivot] - graph.elements[pivot]
    for p in range(graph.begin[pivot], graph.begin[pivot] + graph.elements[pivot]):
        needed += graph.length[graph.lists[p]]
    if graph.used[0] + min(needed, graph.begin.size) > graph.lists.size:
        _compress(graph, work)
    lists, begin, length, size, mark = graph.lists, graph.begin, graph.length, graph.size, graph.mark
    head, after, previous, degrees = graph.head, graph.next, graph.previous, graph.degree
    first, end, degree = graph.used[0], graph.used[0], 0
    mark[pivot] = stamp
    own, count = begin[pivot], graph.elements[pivot]
    for k in range(count + 1):  # its elements, and then its own variables
        source = lists[own + k] if k < count else pivot
        at = begin[source] if k < count else own + count
        for p in range(at, begin[source] + length[source]):
            i = lists[p]
            if size[i] > 0 and mark[i] != stamp:
                mark[i] = stamp
                lists[end] = i
                end += 1
                degree += size[i]
                _remove(head, after, previous, degrees[i], i)
        if k < count:
            size[source], length[source] = 0, 0
    begin[pivot], length[pivot], graph.used[0] = first, end - first, end
    return degree


@borrowing
def _outside(graph: Any, pivot: int, stamp: int, outside: Any, seen: Any) -> None:
    """Compute for each element next to a new one how many of its variables are not in the new one."""
    lists, begin, size = graph.lists, graph.begin, graph.size
    for p in range(begin[pivot], begin[pivot] + graph.length[pivot]):
        i = lists[p]
        for t in range(begin[i], begin[i] + graph.elements[i]):
            e = lists[t]
            if size[e] == 0:
                continue
            if seen[e] != stamp:
                seen[e], outside[e] = stamp, graph.degree[e]
            outside[e] -= size[i]


@borrowing
def _update(graph: Any, pivot: int, i: int, stamp: int, outside: Any) -> tuple[int, int]:
    """Shorten the list of a variable in a new element; return how many variables outside it is adjacent to, at most,
    and the sum of its list. Elements that have no others are absorbed."""
    lists, first, size, mark = graph.lists, graph.begin[i], graph.size, graph.mark
    behind, end = first + graph.elements[i], first + graph.length[i]
    at, degree, total = first, 0, pivot
    for p in range(first, behind):
        e = lists[p]
        if size[e] == 0:
            continue
        if outside[e] > 0:
            degree += outside[e]
            total += e
            lists[at] = e
            at += 1
        else:
            size[e], graph.length[e] = 0, 0
    kept = at
    for p in range(behind, end):
        j = lists[p]
        if size[j] > 0 and mark[j] != stamp:
            degree += size[j]
            total += j
            lists[at] = j
            at += 1
    # the new element is put first; there is room, as the list has lost it or an element that it has absorbed
    lists[at] = lists[kept]
    lists[kept] = lists[first]
    lists[first] = pivot
    graph.elements[i], graph.length[i] = kept - first + 1, at - first + 1
    return degree, total


@borrowing
def _merge(graph: Any, pivot: int, sums: Any, bucket: Any, chain: Any, seen: Any, stamp: int) -> int:
    """Merge those variables of a new element whose lists are the same; return the next stamp.

    sums : of their lists, modulo n; bucket, chain : work, for each sum and variable."""
    lists, begin, length, size = graph.lists, graph.begin, graph.length, graph.size
    own = lists[begin[pivot] : begin[pivot] + length[pivot]]
    for i in own:
        if size[i] > 0:
            chain[i], bucket[sums[i]] = bucket[sums[i]], i
    for first in own:
        i = bucket[sums[first]]
        bucket[sums[first]] = NONE
        while i != NONE and chain[i] != NONE:
            stamp += 1
            for p in range(begin[i] + 1, begin[i] + length[i]):
                seen[lists[p]] = stamp
            before, j = i, chain[i]
            while j != NONE:
                same = length[j] == length[i] and graph.elements[j] == graph.elements[i]
                for p in range(begin[j] + 1, begin[j] + length[j] if same else 0):
                    if seen[lists[p]] != stamp:
                        same = False
                        break
                if same:
                    size[i] += size[j]
                    _append(graph, i, j)
                    length[j] = 0
                    chain[before] = chain[j]
                else:
                    before = j
                j = chain[j]
            i = chain[i]
    return stamp


@compiled
def _full(n: int, value: int) -> Any:
    return np.full(n, value, np.int32)


@compiled
def _quotient_graph(n: int, ptr: Any, ind: Any, order: Any, most: float) -> tuple[Any, int]:
    """Return the quotient graph of a symmetric pattern without rows of more than `most` entries, which are put at the
    end of the order, and how many these are."""
    dense, room = 0, 0
    is_dense = np.zeros(n, np.bool_)
    for i in range(n):
        if ptr[i + 1] - ptr[i] > most:
            is_dense[i] = True
            dense += 1
            order[n - dense] = i
        else:
            room += ptr[i + 1] - ptr[i]
    lists = np.empty(room + room // 4 + n + 1, np.int32)  # all that is alive fits into the first part
    begin, length, size, degree = _full(n, 0), _full(n, 0), _full(n, 0), _full(n, 0)
    of_degree = _full(n + 1, NONE), _full(n, NONE), _full(n, NONE)
    merged = _full(n, NONE), np.arange(n).astype(np.int32)
    mark = np.full(n, NONE, np.int64)
    graph = Graph(lists, np.zeros(1, np.int64), begin, length, _full(n, 0), size, degree, *of_degree, *merged, mark)
    end = 0
    for i in range(n):
        if is_dense[i]:
            continue
        begin[i], size[i] = end, 1
        for p in range(ptr[i], ptr[i + 1]):
            if ind[p] != i and not is_dense[ind[p]]:
                lists[end] = ind[p]
                end += 1
        length[i] = degree[i] = end - begin[i]
        _insert(graph.head, graph.next, graph.previous, degree[i], i)
    graph.used[0] = end
    return graph, dense


@compiled
def approximate_minimum_degree(n: int, ptr: Any, ind: Any, most: float) -> Any:
    """Return an order of elimination, shape (n,), for the pattern of a symmetric matrix in compressed rows,
    whatever its diagonal is; rows of more than `most` entries come last."""
    order = np.empty(n, np.int64)
    graph, dense = _quotient_graph(n, ptr, ind, order, most)
    lists, begin, length, size, degree = graph.lists, graph.begin, graph.length, graph.size, graph.degree
    head, after, previous = graph.head, graph.next, graph.previous
    outside, sums, chain, work = _full(n, 0), _full(n, 0), _full(n, NONE), _full(n, 0)
    seen, bucket = np.full(n, NONE, np.int64), _full(n, NONE)
    found, least, stamp, left = 0, 0, 0, n - dense
    while found < n - dense:
        while head[least] == NONE:
            least += 1
        pivot = head[least]
        _remove(head, after, previous, degree[pivot], pivot)
        stamp += 1
        own = size[pivot]
        size[pivot] = 0  # not among its own neighbours
        total = _eliminate(graph, pivot, stamp, work)
        _outside(graph, pivot, stamp, outside, seen)
        left -= own
        for p in range(begin[pivot], begin[pivot] + length[pivot]):
            i = lists[p]
            external, summed = _update(graph, pivot, i, stamp, outside)
            sums[i] = summed % n
            if external == 0:  # it has the same neighbours as the pivot
                left -= size[i]
                total -= size[i]
                _append(graph, pivot, i)
                length[i] = 0
            else:
                degree[i] = min(degree[i], external)
        stamp = _merge(graph, pivot, sums, bucket, chain, seen, stamp)
        at = begin[pivot]
        for p in range(begin[pivot], begin[pivot] + length[pivot]):
            i = lists[p]
            if size[i] > 0:
                degree[i] = min(degree[i] + total - size[i], left - size[i])
                least = min(least, degree[i])
                _insert(head, after, previous, degree[i], i)
                lists[at] = i
                at += 1
        length[pivot], degree[pivot] = at - begin[pivot], total
        size[pivot] = 1 if at > begin[pivot] else 0
        while pivot != NONE:
            order[found], pivot = pivot, graph.follower[pivot]
            found += 1
    return order
