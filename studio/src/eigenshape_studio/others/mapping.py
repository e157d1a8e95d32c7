"""A dense map between two shapes, read in both directions, and corrected by hand."""

from dataclasses import dataclass, replace

import numpy as np

import eigenshape as es
from eigenshape._vectors import nearest_rotations
from eigenshape.matching.spectral_refinement import lowest_modes, modes_of_part, refine_places
from eigenshape_studio.others.search import color_places
from eigenshape_studio.shape.jobs import Progress

# A point of the whole farther than this share of its √area from the image of the part has no partner:
# the distance that the confidence of a match is about.
NEAR = 0.05
LEAST_WEIGHT = (
    1e-3  # of a place that is not sure at all, where no other tells how shapes are turned
)
GRAY = 150  # of 255: what fades to gray may be anywhere
# A correction keeps what agrees with the points given by hand: their distances along both surfaces
# differ by no more than NEAR; or this share of the map, if less agrees, as between individuals.
LEAST_KEPT = 0.25
N_ROUNDS = 2  # the second keeps what agrees with the first, too
N_ANCHORS = 40  # points far from each other of the old map that a correction may keep
N_SAMPLES = 400  # points of the part that a correction places by distances
SOFTNESS = 0.03  # share of √area; added to distances, so that an anchor itself counts most
UNKNOWN = 0.5  # confidence of what a correction has moved: nothing was measured there


@dataclass(frozen=True, eq=False)
class Placed:
    """Where the points of one shape lie on the other one.

    Attributes
    ----------
    points : (n, 3) float
    partners : (n,) int
        The nearest vertex of the other shape, or -1 where there is none.
    confidence : (n,) float
        0 to 1; 0 where there is no partner.
    """

    points: np.ndarray
    partners: np.ndarray
    confidence: np.ndarray


@dataclass(frozen=True, eq=False)
class DenseMap:
    """Two shapes, and for each of them where its vertices lie on the other one.

    Attributes
    ----------
    meshes : (TriangleMesh, TriangleMesh)
        The part, and the whole that it is mapped to.
    placed : (Placed, Placed)
        The vertices of each on the other one.
    match : ShapeMatch, optional
        What the map was made of, unless it was known before.
    """

    meshes: tuple[es.TriangleMesh, es.TriangleMesh]
    placed: tuple[Placed, Placed]
    match: es.matching.ShapeMatch | None = None

    def carry(self, side: int, points: np.ndarray) -> np.ndarray:
        """Return the points of the other shape's surface that correspond to points of one's surface.

        Where nothing corresponds they are NaN.
        """
        mesh, other = self.meshes[side], self.meshes[1 - side]
        there = es.geometry.closest_points(mesh, points)
        corners = mesh.faces[there.simplices]
        images = np.einsum("pc,pcd->pd", there.weights, self.placed[side].points[corners])
        found = es.geometry.closest_points(other, images).points.copy()
        found[self.placed[side].partners[_largest(corners, there.weights)] < 0] = np.nan
        return found

    def similarity(self, side: int) -> np.ndarray:
        """Return the similarity that lays one shape best on the other, (3, 4): [s R | t]."""
        placed, ours = self.placed[0], self.meshes[0].vertices
        weights = placed.confidence[:, None] + LEAST_WEIGHT
        center = (weights * ours).sum(axis=0) / weights.sum()
        center_there = (weights * placed.points).sum(axis=0) / weights.sum()
        arms = ours - center
        product = (weights * (placed.points - center_there)).T @ arms
        turn = nearest_rotations(product[None])[0]
        linear = turn * np.sum(turn * product) / np.sum(weights * arms**2)
        if side == 1:
            linear, center, center_there = np.linalg.inv(linear), center_there, center
        return np.column_stack([linear, center_there - linear @ center])

    def colors(self) -> tuple[np.ndarray, np.ndarray]:
        """Return red, green, blue of the vertices of both: equal where they correspond.

        Places of the whole have the colors of their coordinates; what is not sure fades to gray.
        """
        places = self.meshes[1].vertices
        part = color_places(self.placed[0].points, places)
        return _fade(part, self.placed[0]), _fade(color_places(places), self.placed[1])


def _fade(colors: np.ndarray, placed: Placed) -> np.ndarray:
    faded = GRAY + placed.confidence[:, None] * (colors.astype(np.float64) - GRAY)
    return np.round(faded).astype(np.uint8)


def map_between(
    part: es.TriangleMesh,
    whole: es.TriangleMesh,
    faces: np.ndarray,
    weights: np.ndarray,
    confidence: np.ndarray,
) -> DenseMap:
    """Return the map of which the point of the whole is known for each vertex of the part.

    The map back takes each vertex of the whole to the nearest point of the part's image.

    Parameters
    ----------
    part, whole : TriangleMesh
        With n and m vertices.
    faces, weights : (n,) int, (n, 3) float
        The face of the whole in which each point lies, and its weights there.
    confidence : (n,) float
    """
    corners = whole.faces[faces]
    images = np.einsum("nc,ncd->nd", weights, whole.vertices[corners])
    there = es.geometry.closest_points(es.TriangleMesh(images, part.faces), whole.vertices)
    gaps = np.linalg.norm(there.points - whole.vertices, axis=1)
    near = gaps <= NEAR * np.sqrt(es.geometry.surface_area(whole))
    back = part.faces[there.simplices]
    sure = np.where(near, np.einsum("mc,mc->m", there.weights, confidence[back]), 0.0)
    return DenseMap(
        (part, whole),
        (
            Placed(images, _largest(corners, weights), confidence),
            Placed(
                np.einsum("mc,mcd->md", there.weights, part.vertices[back]),
                np.where(near, _largest(back, there.weights), -1),
                sure,
            ),
        ),
    )


def map_of_match(
    part: es.TriangleMesh, whole: es.TriangleMesh, match: es.matching.ShapeMatch
) -> DenseMap:
    """Return the map that `match_shapes` has found, in both directions."""
    found = map_between(part, whole, match.faces, match.weights, match.confidence)
    return replace(found, match=match)


def correct_map(
    found: DenseMap, match: es.matching.ShapeMatch, pairs: np.ndarray, progress: Progress
) -> DenseMap:
    """Return a map that sends some vertices where a person says, and what is around them, too.

    What agrees with these pairs in distances along both surfaces is kept. Points of the part are
    placed on the whole where distances to the pairs and to what was kept agree best, those to near
    ones most; then eigenfunctions of both shapes make the map smooth, as in `match_shapes`.

    Parameters
    ----------
    found : DenseMap
    match : ShapeMatch
        Of which it was made.
    pairs : (p, 2) int
        A vertex of the part, and the vertex of the whole where it belongs.
    progress : callable
    """
    part, whole = found.meshes
    unit = float(np.sqrt(es.geometry.surface_area(whole)))
    waves = [es.geometry.geodesic_waves(mesh) for mesh in found.meshes]
    scales = match.scale / unit, 1 / unit

    def distances(side: int, vertices: np.ndarray) -> np.ndarray:
        """Return distances from vertices of a shape to all, in √area of the whole."""
        wave = waves[side]
        rows = np.array([wave(vertex) for vertex in vertices.tolist()]) * scales[side]
        return np.minimum(rows, 10.0)  # between pieces they are infinite

    progress(0.0, "distances")
    samples = es.geometry.farthest_points(part, min(N_SAMPLES, part.n_vertices))[0]
    from_samples = distances(0, samples)
    nearest = from_samples.argmin(axis=0)  # sample of each vertex
    ours, theirs = distances(0, pairs[:, 0]), distances(1, pairs[:, 1])
    modes = lowest_modes(whole)
    modes_there = modes_of_part(part, modes)
    places = found.placed[0].partners
    for number in range(N_ROUNDS):
        progress((1 + number) / (2 + N_ROUNDS), "places")
        errors = np.abs(ours[:, samples] - theirs[:, places[samples]]).max(axis=0)
        kept = errors <= max(NEAR, float(np.quantile(errors, LEAST_KEPT)))
        anchors = np.flatnonzero(kept)[:N_ANCHORS]  # the first samples are farthest from each other
        one = np.vstack([ours[:, samples], from_samples[anchors][:, samples]])
        two = np.vstack([theirs, distances(1, places[samples[anchors]])])
        weights = 1 / (SOFTNESS + one) ** 2
        placed = [
            (weights[:, i] @ (two - one[:, i, None]) ** 2).argmin() for i in range(len(samples))
        ]
        # Each vertex goes where its nearest sample goes, until the eigenfunctions smooth that.
        guess = np.array(placed)[nearest]
        faces, shares = refine_places(modes_there, modes, whole, guess)
        places = _largest(whole.faces[faces], shares)

    # The pairs themselves are known. What has moved otherwise was not measured.
    images = np.einsum("nc,ncd->nd", shares, whole.vertices[whole.faces[faces]])
    moved = np.linalg.norm(images - found.placed[0].points, axis=1) > NEAR * unit
    confidence = np.where(moved, UNKNOWN, match.confidence)
    confidence[pairs[:, 0]] = 1.0
    for vertex, place in pairs.tolist():
        faces[vertex] = np.flatnonzero((whole.faces == place).any(axis=1))[0]
        shares[vertex] = whole.faces[faces[vertex]] == place
    corners = whole.faces[faces]
    corrected = replace(
        match,
        vertices=_largest(corners, shares),
        faces=faces,
        corners=corners,
        weights=shares,
        confidence=confidence,
    )
    return map_of_match(part, whole, corrected)


def _largest(corners: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return corners[np.arange(len(corners)), weights.argmax(axis=1)]
