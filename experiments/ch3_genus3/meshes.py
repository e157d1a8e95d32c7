"""Other meshes of one closed surface: with noise, with faces four times denser on one side, and with fewer points."""

import heapq

import numpy as np

import eigenshape as es


def noisy(mesh: es.TriangleMesh, edges: float, rng: np.random.Generator) -> es.TriangleMesh:
    """Move vertices along their normals by Gaussian noise of so many mean edge lengths."""
    size = edges * es.mean_side_length(mesh)
    heights = size * rng.standard_normal((mesh.n_vertices, 1))
    return es.TriangleMesh(mesh.vertices + heights * es.vertex_normals(mesh), mesh.faces)


def denser(mesh: es.TriangleMesh, chosen: np.ndarray) -> es.TriangleMesh:
    """Cut chosen faces in four at the middles of their edges, and their neighbours in two or three so that they fit.

    Nothing moves: it is the same surface.
    """
    table = es.edge_table(mesh)
    cut = np.zeros(len(table.edges), dtype=bool)
    cut[table.face_edges[chosen]] = True
    number = np.full(len(cut), -1)
    number[cut] = mesh.n_vertices + np.arange(cut.sum())
    points = np.concatenate([mesh.vertices, mesh.vertices[table.edges[cut]].mean(axis=1)])
    faces = [
        piece
        for face, middles in zip(mesh.faces, number[table.face_edges], strict=True)
        for piece in pieces(face.tolist(), middles.tolist())
    ]
    return es.TriangleMesh(points, np.array(faces))


def pieces(face: list[int], middles: list[int]) -> list[tuple[int, int, int]]:
    """Cut a face at the middles that it has; `middles[i]` lies across from corner i, -1 where its edge stays whole."""
    while sum(middle >= 0 for middle in middles) in (1, 2) and not (middles[0] >= 0 and middles[1] < 0):
        face, middles = face[1:] + face[:1], middles[1:] + middles[:1]
    (a, b, c), (at_a, at_b, at_c) = face, middles
    if at_a < 0:
        return [(a, b, c)]
    if at_b >= 0:
        return [(a, at_c, at_b), (b, at_a, at_c), (c, at_b, at_a), (at_a, at_b, at_c)]
    if at_c >= 0:
        return [(b, at_a, at_c), (a, at_c, at_a), (a, at_a, c)]
    return [(a, b, at_a), (a, at_a, c)]


def coarser(mesh: es.TriangleMesh, n_vertices: int) -> es.TriangleMesh:
    """Collapse the shortest edges to their middles, one by one, until so many vertices are left.

    An edge is passed over if its ends have more than two neighbours in common (the surface would pinch there), or if a
    face around it would turn by more than 60 degrees.
    """
    points, rings = mesh.vertices.copy(), [set() for _ in range(mesh.n_vertices)]
    faces = {number: tuple(face) for number, face in enumerate(mesh.faces.tolist())}
    for number, face in faces.items():
        for corner in face:
            rings[corner].add(number)
    heap = [
        (length, *edge) for length, edge in zip(es.edge_lengths(mesh), es.edge_table(mesh).edges.tolist(), strict=True)
    ]
    heapq.heapify(heap)
    left = mesh.n_vertices
    while left > n_vertices and heap:
        length, keep, gone = heapq.heappop(heap)
        joint = rings[keep] & rings[gone]
        if not joint or length != np.linalg.norm(points[keep] - points[gone]):
            continue  # collapsed or moved since
        middle = (points[keep] + points[gone]) / 2
        if not may_collapse(points, faces, rings, (keep, gone), middle):
            continue
        for number in joint:
            for corner in faces.pop(number):
                rings[corner].discard(number)
        for number in rings[gone]:
            faces[number] = tuple(keep if corner == gone else corner for corner in faces[number])
        rings[keep] |= rings[gone]
        rings[gone] = set()
        points[keep] = middle
        left -= 1
        for other in neighbours(faces, rings, keep):
            heapq.heappush(heap, (float(np.linalg.norm(points[keep] - points[other])), keep, other))
    used, places = np.unique(np.array(list(faces.values())), return_inverse=True)
    return es.TriangleMesh(points[used], places.reshape(-1, 3))


def neighbours(faces: dict[int, tuple[int, ...]], rings: list[set[int]], vertex: int) -> set[int]:
    """Return the vertices that share a face with one."""
    return {corner for number in rings[vertex] for corner in faces[number]} - {vertex}


def may_collapse(
    points: np.ndarray,
    faces: dict[int, tuple[int, ...]],
    rings: list[set[int]],
    edge: tuple[int, int],
    middle: np.ndarray,
) -> bool:
    """Say whether an edge can become a point without pinching the surface or turning a face over."""
    keep, gone = edge
    common = neighbours(faces, rings, keep) & neighbours(faces, rings, gone)
    if len(common) != 2 or any(len(rings[corner]) <= 3 for corner in common):
        return False
    around = np.array([faces[number] for number in rings[keep] ^ rings[gone]])
    before = points[around]
    after = np.where(np.isin(around, edge)[..., None], middle, before)
    one, two = (np.cross(each[:, 1] - each[:, 0], each[:, 2] - each[:, 0]) for each in (before, after))
    return bool(
        np.all(
            np.einsum("ij,ij->i", one, two)
            > np.cos(np.pi / 3) * np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
        )
    )
