"""A rig: what a shape needs once so that it can be bent many times."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_solve

from eigenshape._arguments import require_type
from eigenshape._arrays import finite_rows, frozen, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._progress import Progress
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.deformation.rigidity import EdgeWeights, edge_weights
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import vertex_components
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

N_MODES = 300


@dataclass(frozen=True, eq=False)
class EigenRig:
    """A shape, its low modes, and what was factored for them.

    Attributes
    ----------
    mesh : TriangleMesh
        The shape as it stands; edits bend it.
    eigenvectors : (n, k) float
        Φ, of the shape as it was when it was rigged.
    eigenvalues : (k,) float
        In 1/length² of that shape.
    areas : (n,) float
        Of the vertices, in length²: what each has of the mass in which the modes are orthonormal.
    factor : (k, k) float
        Lower triangular, with factor factorᵀ = ΦᵀΦ, the Gram matrix; its leading part is that of fewer modes
        (thesis 6.3.4).
    edges : EdgeWeights
    """

    mesh: TriangleMesh
    eigenvectors: Float[np.ndarray, "n k"]
    eigenvalues: Float[np.ndarray, " k"]
    areas: Float[np.ndarray, " n"]
    factor: Float[np.ndarray, "k k"]
    edges: EdgeWeights

    @property
    def n_modes(self) -> int:
        """Number of modes, k."""
        return len(self.eigenvalues)

    @cached_property
    def components(self) -> Int[np.ndarray, " n"]:
        """The number of each vertex' component."""
        return frozen(vertex_components(self.mesh)[1])


def rig_shape(
    mesh: MeshLike, spectrum: Spectrum | None = None, *, progress: Progress | None = None
) -> EigenRig:
    """Prepare a shape for many edits.

    Parameters
    ----------
    mesh : MeshLike
        Its faces may not be flat, and each vertex has one.
    spectrum : Spectrum, optional
        Of any operator of the shape (the thesis takes the mesh Laplacian); by default the 300 lowest modes of the
        cotangent Laplacian, and one more for each component beyond the first.
    progress : callable, optional
        As for `solve_spectrum`.

    Returns
    -------
    EigenRig

    Raises
    ------
    InvalidShapeError
        If a face has no area, or a vertex no face.
    InvalidParameterError
        If the spectrum is of another number of vertices.
    """
    mesh = as_mesh(mesh)
    require_type(spectrum, Spectrum | None, "spectrum")
    laplacian = cotangent_laplacian(mesh)
    if spectrum is None:
        n_components, _ = vertex_components(mesh)
        spectrum = solve_spectrum(
            laplacian, min(N_MODES + n_components - 1, mesh.n_vertices), progress=progress
        )
    modes = spectrum.eigenvectors
    if len(modes) != mesh.n_vertices:
        raise InvalidParameterError(
            f"The spectrum is of {len(modes)} vertices, the shape has {mesh.n_vertices}."
        )
    with one_blas_thread():
        factor = np.asarray(
            np.linalg.qr(modes, mode="r")
        ).T  # of the Gram matrix too, without squaring how unequal areas are
    edges = edge_weights(laplacian.stiffness)
    return EigenRig(
        mesh,
        modes,
        spectrum.eigenvalues,
        frozen(spectrum.mass @ np.ones(len(modes))),
        frozen(factor),
        edges,
    )


def posed(rig: EigenRig, vertices: ArrayLike) -> EigenRig:
    """Return the rig of the same shape in another pose; its modes stay, since bending hardly changes them.

    Raises
    ------
    InvalidShapeError
        If a coordinate is not finite, or their number is another one.
    """
    return replace(rig, mesh=TriangleMesh(finite_rows(vertices, "vertices", 3), rig.mesh.faces))


def projected(
    rig: EigenRig, values: Float[np.ndarray, "n q"], n_modes: int
) -> Float[np.ndarray, "m q"]:
    """Return the coefficients of the least-squares fit by the lowest modes (thesis eq. 6.1)."""
    return cho_solve(
        (rig.factor[:n_modes, :n_modes], True), rig.eigenvectors[:, :n_modes].T @ values
    )


@one_blas_thread()
def eigen_skeleton(rig: EigenRig, n_modes: SupportsIndex) -> Float[np.ndarray, "n 3"]:
    """Return the vertices of a shape as its lowest modes know them (thesis 6.1.1).

    Parameters
    ----------
    rig : EigenRig
    n_modes : int
        1 to k.

    Returns
    -------
    (n, 3) float
        With the faces of the shape, its eigen-skeleton.

    Raises
    ------
    InvalidParameterError
        If the rig has fewer modes.
    """
    require_type(rig, EigenRig, "rig")
    wanted = whole_number(n_modes, "n_modes", 1, rig.n_modes)
    return rig.eigenvectors[:, :wanted] @ projected(rig, rig.mesh.vertices, wanted)
