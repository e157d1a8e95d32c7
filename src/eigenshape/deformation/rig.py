"""A rig: what is computed once for a shape, so that it can be deformed many times."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_solve

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, freeze, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import finite_rows
from eigenshape.deformation.rigidity import EdgeWeights, edge_weights
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import warn_of_seams
from eigenshape.geometry.topology import vertex_components
from eigenshape.operators.cotangent import surface_laplacian
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

# Modes of a rig: as many as the finest skeleton of the thesis has (6.3.3). More take longer to
# solve.
N_MODES = 300


@record
class EigenRig(ReadOnly):
    """A shape, its lowest modes and the matrices that deformation needs.

    Attributes
    ----------
    mesh : TriangleMesh
        The shape in its present pose.
    eigenvectors : (n, k) float
        The modes Φ of the shape in its original pose.
    eigenvalues : (k,) float
        Their eigenvalues, in 1/length².
    areas : (n,) float
        Row sums of the mass matrix for which the modes are orthonormal, in length².
    factor : (k, k) float
        Cholesky factor of the Gram matrix: lower triangular, with factor factorᵀ = ΦᵀΦ. Its leading
        block is the factor for fewer modes (thesis 6.3.4).
    edges : EdgeWeights
        Weights of the edges in the rigidity energy.

    See Also
    --------
    rig_shape : Compute a rig.
    deform : Move a region of a rigged shape.

    Examples
    --------
    >>> import eigenshape as es
    >>> rig = es.rig_shape(es.icosphere(2))
    >>> rig.eigenvectors.shape, round(float(rig.areas.sum()), 2)
    ((162, 162), 12.33)
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
        """Component of each vertex, (n,) int."""
        return freeze(vertex_components(self.mesh)[1])


def rig_shape(
    mesh: MeshLike, spectrum: Spectrum | None = None, *, progress: Progress | None = None
) -> EigenRig:
    """Prepare a shape for deformation.

    Parameters
    ----------
    mesh : MeshLike
    spectrum : Spectrum, optional
        Spectrum of any operator on the shape (the thesis uses the mesh Laplacian). By default, the
        300 lowest modes of the cotangent Laplacian, and one more for each component beyond the
        first.
    progress : callable, optional
        Called as ``progress(fraction_done, message)`` by the eigensolver.

    Returns
    -------
    EigenRig

    Raises
    ------
    InvalidShapeError
        If a face has no area, or a vertex has no face.
    InvalidParameterError
        If the spectrum has another number of vertices.

    Warns
    -----
    UserWarning
        If vertices are double along seams, where the shape would come apart.

    See Also
    --------
    deform : Move a region of a rigged shape.
    DeformationSession : Edit a rigged shape step by step.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> es.rig_shape(mesh).n_modes
    162

    Fewer modes:

    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 20)
    >>> es.rig_shape(mesh, spectrum).n_modes
    20
    """
    mesh = as_mesh(mesh)
    require_type(spectrum, Spectrum | None, "spectrum")
    warn_of_seams(mesh)
    laplacian = surface_laplacian(mesh)
    if spectrum is None:
        n_components, _ = vertex_components(mesh)
        wanted = min(N_MODES + n_components - 1, mesh.n_vertices)
        spectrum = solve_spectrum(laplacian, wanted, progress=progress)
    modes = spectrum.eigenvectors
    if len(modes) != mesh.n_vertices:
        raise InvalidParameterError(
            "spectrum must be of the shape; "
            f"it has {len(modes)} points for {mesh.n_vertices} vertices."
        )
    with one_blas_thread():
        # Φ = QR gives ΦᵀΦ = RᵀR, without the squared condition number of forming ΦᵀΦ.
        factor = np.asarray(np.linalg.qr(modes, mode="r")).T
    edges = edge_weights(mesh, laplacian.stiffness)
    areas = spectrum.mass @ np.ones(len(modes))
    return EigenRig(mesh, modes, spectrum.eigenvalues, areas, factor, edges)


def pose_rig(rig: EigenRig, vertices: ArrayLike) -> EigenRig:
    """Return the rig of the same shape in another pose.

    The modes are kept, because bending hardly changes them.

    Raise InvalidShapeError if a coordinate is not finite, or the shape of the array is not (n, 3).
    """
    return replace(rig, mesh=TriangleMesh(finite_rows(vertices, "vertices", 3), rig.mesh.faces))


def project_on_modes(
    rig: EigenRig, values: Float[np.ndarray, "n q"], n_modes: int
) -> Float[np.ndarray, "m q"]:
    """Return the coefficients of the least-squares fit by the lowest modes (thesis eq. 6.1)."""
    return cho_solve(
        (rig.factor[:n_modes, :n_modes], True), rig.eigenvectors[:, :n_modes].T @ values
    )


@one_blas_thread()
def eigen_skeleton(rig: EigenRig, n_modes: Integer) -> Float[np.ndarray, "n 3"]:
    """Compute the least-squares fit of a shape by its lowest modes (thesis 6.1.1).

    Parameters
    ----------
    rig : EigenRig
    n_modes : int
        Number of modes, 1 to k.

    Returns
    -------
    (n, 3) float
        The vertices of the eigen-skeleton; its faces are those of the shape.

    Raises
    ------
    InvalidParameterError
        If `n_modes` is not in 1..k.

    Examples
    --------
    The coordinates on a sphere are modes 1 to 3, so four modes reproduce it:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> rig = es.rig_shape(mesh, es.solve_spectrum(es.cotangent_laplacian(mesh), 10))
    >>> skeleton = es.deformation.eigen_skeleton(rig, 4)
    >>> bool(np.abs(skeleton - mesh.vertices).max() < 1e-2)
    True
    """
    require_type(rig, EigenRig, "rig")
    wanted = whole_number(n_modes, "n_modes", 1, rig.n_modes)
    return rig.eigenvectors[:, :wanted] @ project_on_modes(rig, rig.mesh.vertices, wanted)
