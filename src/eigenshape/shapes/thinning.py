"""Decimation: fewer vertices on a closed mesh of the same topology."""

import heapq
import math

import numpy as np

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table

# Numbers of neighbors that a collapse may leave a vertex with. Outside this range triangles become
# slivers; in a regular mesh every vertex has 6.
FEWEST_NEIGHBORS, MOST_NEIGHBORS = 4, 8


def collapse_shortest_edges(mesh: TriangleMesh, n_vertices: int) -> TriangleMesh:
    """Collapse the shortest edges of a closed manifold until it has at most `n_vertices` vertices.

    An edge collapses to its midpoint if its ends have exactly two neighbors in common, so that the
    surface stays a manifold of the same genus (the link condition: Dey, Edelsbrunner, Guha and
    Nekhayev 1999), and if no vertex gets too few or too many neighbors. If no edge may collapse,
    more vertices remain.
    """
    points, edges = mesh.vertices.tolist(), edge_table(mesh).edges.tolist()
    around: list[set[int]] = [set() for _ in points]
    for one, two in edges:
        around[one].add(two)
        around[two].add(one)
    shortest = [(math.dist(points[one], points[two]), one, two) for one, two in edges]
    heapq.heapify(shortest)
    target = list(range(mesh.n_vertices))
    surplus = mesh.n_vertices - n_vertices
    while surplus > 0 and shortest:
        length, kept, gone = heapq.heappop(shortest)
        # The heap still holds edges that have collapsed or changed their length since.
        out_of_date = gone not in around[kept] or length != math.dist(points[kept], points[gone])
        if out_of_date:
            continue
        common = around[kept] & around[gone]
        n_left = len(around[kept]) + len(around[gone]) - 4
        if (
            len(common) != 2
            or not FEWEST_NEIGHBORS <= n_left <= MOST_NEIGHBORS
            or any(len(around[other]) <= FEWEST_NEIGHBORS for other in common)
        ):
            continue
        points[kept] = [(x + y) / 2 for x, y in zip(points[kept], points[gone], strict=True)]
        target[gone] = kept
        for other in around[gone]:
            around[other].remove(gone)
            if other != kept:
                around[other].add(kept)
                around[kept].add(other)
        around[gone] = set()
        for other in sorted(around[kept]):
            heapq.heappush(shortest, (math.dist(points[kept], points[other]), kept, other))
        surplus -= 1
    # Replace the corners of faces by what they have collapsed to, and leave out collapsed faces.
    into = np.array(target)
    while (into[into] != into).any():
        into = into[into]
    stays, number = np.unique(into, return_inverse=True)
    corners = number[mesh.faces]
    alive = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return TriangleMesh(np.array(points)[stays], corners[alive])
