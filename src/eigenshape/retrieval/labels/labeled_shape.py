"""A shape whose faces have labels, and points of it with all that matching them by optimal transport needs."""

from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, freeze, record
from eigenshape._arrays import face_labels
from eigenshape._corners import mean_normals
from eigenshape._errors import InvalidShapeError, try_auto
from eigenshape._vectors import row_dots
from eigenshape.geometry.conversion import as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_mesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.requirements import require_describable
from eigenshape.operators.smoothing import denoise
from eigenshape.retrieval.patches.codebook import (
    default_codebook,
    whiten_patches,
)
from eigenshape.retrieval.patches.matching import PatchPoints, patch_points
from eigenshape.retrieval.patches.patches import surface_patches

# Points of each shape. Time grows with the cube; 300 lie 6 hundredths of √area apart.
N_LABEL_POINTS = 300
# Distance between components, in largest distances within one.
APART = 1.5
# Cosine of the widest angle between the normal and the chord of an inscribed ball. Beyond it, the
# ball touches the same side of the surface, where noise decides its radius.
LEAST_COSINE = 0.3
SHORTEST_CHORD = 0.01  # sides of the box; shorter chords are within the same patch
SMALLEST_RADIUS, LARGEST_RADIUS = 0.005, 1.0  # of balls, in sides of the box


@record
class LabelPoints(ReadOnly):
    """Points of a shape, their descriptors, and their distances.

    Attributes
    ----------
    vertices : (m,) int
    shares : (m,) float
        Share of the area that each point stands for; they sum to 1.
    patches : PatchPoints
        What `match_patches` takes.
    numbers : (s, m, d) float
        Whitened patches at all base radii side by side, for each of s sizes.
    radii : (m, 2) float
        Logarithms of the radii of the balls that touch the surface from inside, and from outside.
    distances : (m, m) float
        Geodesic distances, over the root of their mean square.
    """

    vertices: Int[np.ndarray, " m"]
    shares: Float[np.ndarray, " m"]
    patches: PatchPoints
    numbers: Float[np.ndarray, "s m d"]
    radii: Float[np.ndarray, "m 2"]
    distances: Float[np.ndarray, "m m"]


def label_points(mesh: TriangleMesh) -> LabelPoints:
    """Describe points of a mesh, oriented outward and denoised first, as `describe` does."""
    require_describable(mesh)
    clean = denoise(orient_outward(mesh))

    found = surface_patches(clean, n_samples=N_LABEL_POINTS)
    cells = found.weights.max(axis=1).astype(np.float64)
    shares = cells / cells.sum()
    # Components are farther from each other than any points within one.
    distances = found.distances.astype(np.float64)
    finite = np.isfinite(distances)
    farthest = max(distances[finite].max(), SHORTEST_CHORD)
    distances = np.where(finite, distances, APART * farthest)
    codebook = default_codebook()
    numbers = [
        np.concatenate(of_size, axis=1)
        for of_size in whiten_patches(found, codebook).swapaxes(0, 1)
    ]
    # Radii of the largest balls that touch the surface at a point from either side
    unit = normalize_mesh(clean, "box")
    normals = mean_normals(unit)
    radii = np.full((len(found.vertices), 2), LARGEST_RADIUS)
    for row, vertex in enumerate(found.vertices):
        chords = unit.vertices[vertex] - unit.vertices
        squares = row_dots(chords, chords)
        heights = chords @ normals[vertex]
        far = squares > SHORTEST_CHORD**2
        for column, side in enumerate((heights, -heights)):
            facing = far & (side > LEAST_COSINE * np.sqrt(squares))
            least = (squares[facing] / side[facing]).min(initial=2 * LARGEST_RADIUS) / 2
            radii[row, column] = max(least, SMALLEST_RADIUS)
    return LabelPoints(
        vertices=found.vertices,
        shares=shares,
        patches=patch_points(found, codebook),
        numbers=np.stack(numbers),
        radii=np.log(radii),
        distances=distances / np.sqrt(shares @ distances**2 @ shares),
    )


@record
class LabeledShape(ReadOnly):
    """A shape with a label on each face, from which `transfer_labels` copies.

    The shape is described when its labels are first transferred, and the description is kept, so
    that one shape labels many at little more than the cost of their descriptions.

    Attributes
    ----------
    mesh : TriangleMesh
        Or what `as_mesh` takes.
    labels : (f,) int
        Label of each face. A label means the same on all shapes that are used together.
    report : tuple of str
        What was repaired when the shape was read.

    Raises
    ------
    InvalidParameterError
        If `labels` are not f integers.

    See Also
    --------
    transfer_labels, es.io.read_labeled_shapes

    Examples
    --------
    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=500)
    >>> labeled = es.retrieval.LabeledShape(fish, es.find_parts(fish).parts.labels)
    >>> labeled.mesh.n_faces == len(labeled.labels)
    True
    """

    mesh: TriangleMesh
    labels: Int[np.ndarray, " f"]
    report: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        mesh = as_mesh(self.mesh)
        labels = face_labels(self.labels, "labels", mesh)
        vars(self).update(mesh=mesh, labels=freeze(labels.astype(np.int64)))

    @cached_property
    def points(self) -> LabelPoints:
        """Return the points that are matched with those of other shapes."""
        try:
            return label_points(self.mesh)
        except InvalidShapeError as error:
            # A repair alone removes and splits faces, and the labels would no longer fit
            remedy = (
                'Try es.io.read_labeled_shape(path, repair=["auto"]), which repairs the labels too, '
                "or --repair auto on the command line."
            )
            raise InvalidShapeError(str(error).replace(try_auto(), remedy)) from error
