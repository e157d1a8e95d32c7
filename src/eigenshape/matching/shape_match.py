"""A map from a part to a whole, with how sure it is of each vertex."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int, Integer
from numpy.typing import DTypeLike, NDArray

from certeig.kit.arrays import ReadOnly, as_array, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.files import as_path, replace_file
from certeig.kit.typing import ArrayLike

COLUMNS = "vertex,whole_vertex,face,weight_1,weight_2,weight_3,confidence"


@record
class ShapeMatch(ReadOnly):
    """Where each vertex of a part lies on a whole.

    Of two parts that overlap, vertices outside the overlap have no place: `vertices`, `faces` and
    `corners` are -1 there, `weights` nan, and `confidence` and `evidence` 0.

    Attributes
    ----------
    vertices : (n,) int
        For each of the n vertices of the part, the nearest vertex of the whole.
    faces : (n,) int
        The face of the whole in which its point lies.
    corners : (n, 3) int
        The corners of that face.
    weights : (n, 3) float
        Barycentric coordinates of the point in it.
    confidence : (n,) float
        Probability, 0 to 1, that the point is less than 0.05 √area of the whole from the true one,
        along the surface. 0 on pieces that are too small to be matched.
    evidence : (n, 12) float
        Numbers from which the confidence is computed by logistic regression; 0 where there are none:
        local orientation, misfit of distances, distance to the next matched point, distance to where
        other starts put the vertex, local stretch, gap that is left after bending, weight of the
        nearest patch, its difference from that of its image; and of the whole map orientation,
        support, mean difference, and the logarithm of the gap after bending times the root of strain.
        Of parts that overlap, 3 columns: change of distances, gap, and how good the whole map is.
    score : float
        How good the whole map is, 0 to 1: orientation × coverage² × support of pairs × likeness⁴ of
        patches. Of the sizes that `scale="unknown"` tries, the one with the highest score is taken.
    orientation : float
        Share of the part's area that the map keeps, minus the share that it turns over.
    coverage : float
        Area of the whole that the part covers, as a share of the part's own, at most 1. Less means
        that different places of the part came to lie on one place.
    handed : bool
        Whether the shape tells left from right. False if the mirror image of the part fits the
        whole as well, so that left and right may be exchanged.
    n_equally_good : int
        How many maps that differ over most of the part fit as well as this one, itself among them: 1
        if it is the only one. A ball turned on itself has many, a cube 24. The search ends at about
        ten. A whole of two equal pieces has two, and `report` names the other piece. A small part has
        one more for each place that fits but for what a pose changes, and a body one whose back fits
        within a tenth. Where other maps place a vertex elsewhere, its confidence is divided by their
        number.
    scale : float
        Factor by which lengths of the part were multiplied.
    mirrored : bool
        Whether the mirror image of the part was matched.
    report : tuple of str
        What was chosen or left out, in sentences: the scale, loose pieces, and, of a whole of several
        pieces, which piece of the part was placed on which of them. Of parts that overlap, how much of
        each is shared.
    covered : (m,) bool, optional
        Of parts that overlap, which vertices of the other part lie in the overlap.

    See Also
    --------
    match_shapes : Compute one.

    Examples
    --------
    >>> import eigenshape as es
    >>> pose, other = (es.make_creature("quadruped", pose, n_vertices=600) for pose in (0, 1))
    >>> match = es.match_shapes(pose, other)
    >>> match.pull(other.vertices).shape == pose.vertices.shape  # where each vertex went
    True
    """

    vertices: Int[np.ndarray, " n"]
    faces: Int[np.ndarray, " n"]
    corners: Int[np.ndarray, "n 3"]
    weights: Float[np.ndarray, "n 3"]
    confidence: Float[np.ndarray, " n"]
    evidence: Float[np.ndarray, "n c"]
    score: float
    orientation: float
    coverage: float
    handed: bool
    n_equally_good: int
    scale: float
    report: tuple[str, ...]
    mirrored: bool = False
    covered: Bool[np.ndarray, " m"] | None = None

    @property
    def mapped(self) -> Bool[np.ndarray, " n"]:
        """Which vertices of the part have a place: all, or of parts that overlap those that both have."""
        return self.vertices >= 0

    @property
    def n_vertices(self) -> int:
        """Number of vertices of the part, n."""
        return len(self.vertices)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """Return `vertices`, so that functions that take a list of vertices take a match."""
        return np.array(self.vertices, dtype=dtype)

    def save(self, path: str | Path) -> None:
        """Write the map; the file appears complete or not at all.

        Parameters
        ----------
        path : path
            A file that ends in ``.csv`` is a table with a row for each vertex of the part: the
            nearest vertex of the whole, the face, the weights of its corners, and the confidence.
            One in ``.txt`` has the nearest vertices alone, one a line. One in ``.npz`` has the
            arrays vertices, faces, corners, weights and confidence.

        Raises
        ------
        InvalidParameterError
            If the name ends in none of these.
        OSError
            If the file cannot be written.
        """
        path = as_path(path)
        suffix = path.suffix.lower()
        file = BytesIO()
        if suffix == ".txt":
            np.savetxt(file, self.vertices, fmt="%d")
        elif suffix == ".csv":
            number = np.arange(self.n_vertices)
            columns = number, self.vertices, self.faces, self.weights, self.confidence
            formats = "%d,%d,%d,%.6g,%.6g,%.6g,%.4g"
            np.savetxt(file, np.column_stack(columns), formats, header=COLUMNS, comments="")
        elif suffix == ".npz":
            arrays = "vertices", "faces", "corners", "weights", "confidence"
            np.savez_compressed(file, **{name: getattr(self, name) for name in arrays})
        else:
            raise InvalidParameterError(
                f"A map must be written to a file that ends in .csv, .txt or .npz; {path} ends in "
                f"{path.suffix!r}."
            )
        replace_file(path, file.getvalue())

    def pull(
        self, values: ArrayLike
    ) -> Float[np.ndarray, "n ..."] | Integer[np.ndarray, "n ..."] | Bool[np.ndarray, "n ..."]:
        """Give each vertex of the part the value of its point on the whole.

        Parameters
        ----------
        values : (m, ...) array
            A value, or a row of values, for each vertex of the whole. Floats, such as positions or
            functions, are interpolated; whole numbers and booleans, such as labels, are copied from
            the nearest vertex. Vertices without a place get nan, -1 in whole numbers with a sign, else 0.

        Returns
        -------
        (n, ...) array

        Raises
        ------
        InvalidParameterError
            If there are fewer values than the whole has vertices.
        """
        table = as_array(values, "values")
        last = int(self.corners.max(initial=-1))
        if table.ndim < 1 or len(table) <= last:
            raise InvalidParameterError(
                "values must have a row for each vertex of the whole; the shape is "
                f"{table.shape}, and the map uses vertex {last}."
            )
        if table.dtype.kind in "iub":
            found = table[self.vertices]
            found[~self.mapped] = -1 if table.dtype.kind == "i" else 0
            return found
        return np.einsum("nc,nc...->n...", self.weights, table[self.corners])

    def sure(self, least: float = 0.5) -> Bool[np.ndarray, " n"]:
        """Return which vertices have at least this confidence.

        Parameters
        ----------
        least : float
            0 to 1.
        """
        return self.confidence >= least
