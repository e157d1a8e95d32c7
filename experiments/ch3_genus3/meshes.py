"""Other meshes of one closed surface: with noise, with faces four times denser on one side, and with fewer points."""

import heapq

import numpy as np

import eigenshape as es


def noisy(mesh: es.TriangleMesh, edges: float, rng: np.random.Generator) -> es.TriangleMesh:
    """Move vertices along their normals by Gaussian noise of so many mean edge lengths."""
    size = edges * es.geometry.mean_side_length(mesh)
    heights = size * rng.standard_normal((mesh.n_vertices, 1))
    return es.TriangleMesh(mesh.vertices + heights * es.geometry.vertex_normals(mesh), mesh.faces)


def denser(mesh: es.TriangleMesh, chosen: np.ndarray) -> es.TriangleMesh:
    """Cut chosen faces in four at the middles of their edges, and their neighbors in two or three so that they fit.

    Nothing moves: it is the same surface.
    """
    table = es.geometry.edge_table(mesh)
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
    while sum(middle >= 0 for middle in middles) in (1, 2) and not (
        middles[0] >= 0 and middles[1] < 0
    ):
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

    An edge is passed over if its ends have more than two neighbors in common (the surface would
    pinch there), or if a face around it would turn by more than 60 degrees.

    Which edge is the shortest must not depend on the last digit of a length, which another CPU
    rounds otherwise. So points are whole numbers: places on a grid of 2³⁰ steps along the longest
    side of the box. Lengths are compared exactly, and of equal ones the lower numbers go first.
    """
    # a power of two, so that dividing by it rounds nothing
    step = 2.0 ** (np.frexp(np.ptp(mesh.vertices, axis=0).max())[1] - 30)
    corner = mesh.vertices.min(axis=0)
    points = np.rint((mesh.vertices - corner) / step).astype(np.int64)
    rings = [set() for _ in range(mesh.n_vertices)]
    faces = {number: tuple(face) for number, face in enumerate(mesh.faces.tolist())}
    for number, face in faces.items():
        for vertex in face:
            rings[vertex].add(number)
    edges = es.geometry.edge_table(mesh).edges.tolist()
    heap = [(squared_length(points, *edge), *edge) for edge in edges]
    heapq.heapify(heap)
    left = mesh.n_vertices
    while left > n_vertices and heap:
        length, keep, gone = heapq.heappop(heap)
        joint = rings[keep] & rings[gone]
        if not joint or length != squared_length(points, keep, gone):
            continue  # collapsed or moved since
        middle = (points[keep] + points[gone]) // 2
        if not may_collapse(points, faces, rings, (keep, gone), middle):
            continue
        for number in joint:
            for vertex in faces.pop(number):
                rings[vertex].discard(number)
        for number in rings[gone]:
            faces[number] = tuple(keep if vertex == gone else vertex for vertex in faces[number])
        rings[keep] |= rings[gone]
        rings[gone] = set()
        points[keep] = middle
        left -= 1
        for other in neighbors(faces, rings, keep):
            heapq.heappush(heap, (squared_length(points, keep, other), keep, other))
    used, places = np.unique(np.array(list(faces.values())), return_inverse=True)
    return es.TriangleMesh(corner + step * points[used], places.reshape(-1, 3))


def squared_length(points: np.ndarray, one: int, other: int) -> int:
    """Return the squared length of an edge between points of whole numbers, exactly."""
    return sum(
        (a - b) ** 2 for a, b in zip(points[one].tolist(), points[other].tolist(), strict=True)
    )


def neighbors(faces: dict[int, tuple[int, ...]], rings: list[set[int]], vertex: int) -> set[int]:
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
    common = neighbors(faces, rings, keep) & neighbors(faces, rings, gone)
    if len(common) != 2 or any(len(rings[corner]) <= 3 for corner in common):
        return False
    around = np.array([faces[number] for number in rings[keep] ^ rings[gone]])
    before = points[around]
    after = np.where(np.isin(around, edge)[..., None], middle, before)
    # whole numbers of Python: products of four coordinates and more do not fit into 64 bits
    one, two = (
        np.cross(each[:, 1] - each[:, 0], each[:, 2] - each[:, 0]).astype(object)
        for each in (before, after)
    )
    product = (one * two).sum(axis=1)
    squares = (one * one).sum(axis=1) * (two * two).sum(axis=1)
    # the cosine of the turn, product / √squares, lies above that of 60 degrees, 1/2
    return bool(np.all((product > 0) & (4 * product * product > squares)))
