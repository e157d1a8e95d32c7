"""Fewer vertices on a surface, with the same topology, for work that needs no details."""

import numpy as np
from jaxtyping import Int

from eigenshape._vectors import size_one
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.resolution.thinning_loops import (
    FIXED,
    RIM,
    collapse_short_edges,
    link_corners,
)
from eigenshape.geometry.simplices import mean_side_length
from eigenshape.geometry.topology import submesh

# Edges collapse up to this length first, in mean edge lengths, and then up to LENGTH_GROWTH times the last
# length: by small steps the spacing stays even (in the last pass at most a fifth of it differs).
FIRST_LENGTH = 0.7
LENGTH_GROWTH = 1.2
# Most neighbors of a vertex, so that fans do not become slivers; a regular vertex has 6.
MOST_NEIGHBORS = 12
# Least cosine between the normals of a face before and after a collapse. If the noise of a scan is
# larger than its edges, normals mean nothing and few edges may collapse. So passes beyond
# STRICT_LENGTH times the edge length of the target do not compare them.
LEAST_COSINE = 0.2
STRICT_LENGTH = 1.5
# Passes after which the surface stays as it is, whether it has few enough vertices or not: its
# components and holes may need more.
MOST_PASSES = 80


def thin_out(mesh: TriangleMesh, n_vertices: int) -> tuple[TriangleMesh, Int[np.ndarray, " k"]]:
    """Collapse short edges until a surface has at most `n_vertices` vertices, where its topology allows.

    Vertices move into neighbors, so that those that stay are vertices of `mesh`, unchanged.
    Boundaries stay boundaries, and closed components stay closed; vertices at edges with more than
    two faces stay where they are.

    Returns
    -------
    thin : TriangleMesh
    source : (k,) int
        For each vertex of `thin`, its index in `mesh`.
    """
    points, _ = size_one(mesh.vertices)
    faces = np.array(mesh.faces)
    alive = np.ones(mesh.n_faces, dtype=np.bool_)
    heads = np.full(mesh.n_vertices, -1, dtype=np.int64)
    links = np.empty(faces.size, dtype=np.int64)
    link_corners(faces, heads, links)

    table = facet_table(mesh)
    kinds = np.zeros(mesh.n_vertices, dtype=np.int64)
    kinds[table.facets[table.n_simplices == 1]] = RIM
    kinds[table.facets[table.n_simplices > 2]] = FIXED

    edge = mean_side_length(TriangleMesh(points, mesh.faces))
    usual = edge * (mesh.n_vertices / n_vertices) ** 0.5
    marks = np.zeros((mesh.n_vertices + 1, 2), dtype=np.int64)
    length, n_left = FIRST_LENGTH * edge, int(np.count_nonzero(heads >= 0))
    for _ in range(MOST_PASSES):
        if n_left <= n_vertices:
            break
        cosine = LEAST_COSINE if length < STRICT_LENGTH * usual else -1.0
        limits = length, MOST_NEIGHBORS, cosine
        n_left -= collapse_short_edges(points, faces, alive, heads, links, kinds, marks, *limits)
        length *= LENGTH_GROWTH
    thin, source = submesh(TriangleMesh(mesh.vertices, faces), alive)
    return thin, source
