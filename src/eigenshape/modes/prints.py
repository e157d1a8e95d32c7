"""The print of a brain: normalized spectra of its structures, their distances and asymmetry."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type, require_unicode
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.spectral.comparison.eigenvalues import shape_dna

# How names of structures begin on the left and on the right: lh.pial, Left-Caudate, left_thalamus.
SIDES = (("lh", "rh"), ("Left", "Right"), ("left", "right"))


@record
class BrainPrint(ReadOnly):
    """Normalized eigenvalues of the structures of a brain.

    Attributes
    ----------
    names : tuple of str
        Of the s structures.
    values : (s, k) float
        A λ_i / i of each structure, as of `es.spectral.shape_dna`.

    See Also
    --------
    brain_print : Compute it.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> egg = es.TriangleMesh(ball.vertices * [1, 1, 1.3], ball.faces)
    >>> found = es.modes.brain_print({"Left-Caudate": ball, "Right-Caudate": egg}, 20)
    >>> {name: round(value) for name, value in found.asymmetry().items()}
    {'Left-Caudate': 6}
    """

    names: tuple[str, ...]
    values: Float[np.ndarray, "s k"]

    def distances(self, other: "BrainPrint") -> dict[str, float]:
        """Return, for each structure of both brains, the Euclidean distance of its values.

        Parameters
        ----------
        other : BrainPrint
            With as many values of a structure.

        Raises
        ------
        InvalidParameterError
            If the brains have no structure in common, or numbers of values differ.
        """
        require_type(other, BrainPrint, "other")
        common = [name for name in self.names if name in other.names]
        if not common or self.values.shape[1] != other.values.shape[1]:
            raise InvalidParameterError(
                "Both prints must have a structure in common, and as many values of each; "
                f"they have {self.values.shape[1]} values of {', '.join(self.names)} and "
                f"{other.values.shape[1]} of {', '.join(other.names)}."
            )
        return {name: float(np.linalg.norm(self._of(name) - other._of(name))) for name in common}

    def asymmetry(self) -> dict[str, float]:
        """Return, for each structure on the left, the distance of its values to those on the right.

        Names of structures on the left begin with lh, Left or left, and those on the right are the
        same with rh, Right or right.

        Raises
        ------
        InvalidParameterError
            If no structure is there on both sides.
        """
        pairs = {
            name: right + name.removeprefix(left)
            for name in self.names
            for left, right in SIDES
            if name.startswith(left) and right + name.removeprefix(left) in self.names
        }
        if not pairs:
            raise InvalidParameterError(
                "A structure must be there on both sides, such as lh.pial and rh.pial, or "
                f"Left-Caudate and Right-Caudate; there are {', '.join(self.names)}."
            )
        return {
            one: float(np.linalg.norm(self._of(one) - self._of(two))) for one, two in pairs.items()
        }

    def _of(self, name: str) -> Float[np.ndarray, " k"]:
        return np.asarray(self.values[self.names.index(name)])


def brain_print(surfaces: Mapping[str, MeshLike], n_values: Integer = 50) -> BrainPrint:
    """Describe a brain by the normalized spectra of its structures (BrainPrint; Wachinger and others 2015).

    Parameters
    ----------
    surfaces : {name: MeshLike}
        Surface of each structure, such as lh.white, rh.white and Left-Hippocampus.
    n_values : int
        Number of values of each structure.

    Returns
    -------
    BrainPrint

    Raises
    ------
    InvalidParameterError
        If there is no structure, or `n_values` is out of range for one.
    InvalidShapeError
        If the Laplacian of a structure cannot be built; the message names it.

    See Also
    --------
    es.spectral.shape_dna : The values of one surface, and how they are normalized.
    es.spectral.compare_spectra : All eigenvalues of two spectra, side by side.

    Examples
    --------
    >>> import eigenshape as es
    >>> found = es.modes.brain_print({"lh.white": es.icosphere(3)}, 20)
    >>> found.values.shape
    (1, 20)
    """
    require_type(surfaces, Mapping, "surfaces")
    if not surfaces:
        raise InvalidParameterError("surfaces must hold a structure; there is none.")
    rows = []
    for name, surface in surfaces.items():
        require_unicode(name, "Names of structures")
        try:
            rows.append(shape_dna(as_mesh(surface, name), n_values))
        except InvalidShapeError as err:
            raise InvalidShapeError(f"Structure {name}: {err}") from err
    return BrainPrint(tuple(surfaces), np.array(rows))
