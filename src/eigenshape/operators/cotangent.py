"""The cotangent Laplacian: linear finite elements on triangles."""

from typing import Literal

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape.geometry.measure import area_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import in_length, require_volumes, scaled_corners
from eigenshape.geometry.topology import unreferenced_vertices
from eigenshape.operators.laplacian import Laplacian

Mass = Literal["lumped", "consistent", "averaged"]


def cotangent_laplacian(mesh: TriangleMesh, mass: Mass = "lumped") -> Laplacian:
    """Build the linear finite-element Laplacian of a triangle mesh.

    w_ij = (cot α_ij + cot β_ij) / 2 with the angles opposite to the edge (thesis 1.1.2; Pinkall and Polthier
    1993); on a boundary edge the missing angle's term vanishes, which is the Neumann condition. An edge with more
    than two faces sums over all of them.

    Parameters
    ----------
    mesh : TriangleMesh
    mass : "lumped", "consistent" or "averaged"
        B: a third of the incident areas on the diagonal; the full matrix ∫ φ_i φ_j, with the eigenvalues of
        conforming elements, which bound those of the surface from above; or the mean of the two, whose leading
        errors cancel.

    Returns
    -------
    Laplacian
        W without unit, B in length^2.

    Raises
    ------
    InvalidShapeError
        If a face has no area, a vertex has no face, or coordinates are beyond 1e±150.
    InvalidParameterError
        If `mass` is none of the three.
    """
    _require_mass(mass)
    require_volumes(mesh)
    _require_faces_everywhere(mesh)
    corners, scale = scaled_corners(mesh)
    areas = np.linalg.norm(area_vectors(corners), axis=1)
    return Laplacian(_stiffness(mesh, corners, areas), _mass(mesh, in_length(areas, scale, 2), mass))


def _stiffness(mesh: TriangleMesh, corners: Float[np.ndarray, "f 3 3"], areas: Float[np.ndarray, " f"]) -> sp.csr_array:
    to_next = np.roll(corners, -1, axis=1) - corners
    to_last = np.roll(corners, 1, axis=1) - corners
    cotangents = np.einsum("fij,fij->fi", to_next, to_last) / (2 * areas[:, None])
    one, two = np.roll(mesh.faces, -1, axis=1).ravel(), np.roll(mesh.faces, 1, axis=1).ravel()
    weights = _assemble(one, two, cotangents.ravel() / 2, mesh.n_vertices)
    weights = weights + weights.T
    return (sp.diags_array(weights.sum(axis=1)) - weights).tocsr()


def _mass(mesh: TriangleMesh, areas: Float[np.ndarray, " f"], mass: Mass) -> sp.csr_array:
    lumped = np.bincount(mesh.faces.ravel(), weights=np.repeat(areas / 3, 3), minlength=mesh.n_vertices)
    if mass == "lumped":
        return sp.diags_array(lumped).tocsr()
    # Full mass: A/6 for a corner with itself, A/12 for two corners of one face; half of the diagonal is lumped's.
    rows, columns = np.roll(mesh.faces, -1, axis=1).ravel(), np.roll(mesh.faces, 1, axis=1).ravel()
    off_diagonal = _assemble(rows, columns, np.repeat(areas / 12, 3), mesh.n_vertices)
    full = (sp.diags_array(lumped / 2) + off_diagonal + off_diagonal.T).tocsr()
    return full if mass == "consistent" else ((full + sp.diags_array(lumped)) / 2).tocsr()


def _assemble(rows: np.ndarray, columns: np.ndarray, entries: np.ndarray, n: int) -> sp.csr_array:
    return sp.coo_array((entries, (rows, columns)), shape=(n, n)).tocsr()


def _require_mass(mass: str) -> None:
    if mass not in ("lumped", "consistent", "averaged"):
        raise InvalidParameterError(f"mass must be 'lumped', 'consistent' or 'averaged'; it is {mass!r}.")


def _require_faces_everywhere(mesh: TriangleMesh) -> None:
    loose = unreferenced_vertices(mesh)
    if loose.size:
        raise InvalidShapeError(
            f"Every vertex must belong to a face; vertex {loose[0]} at {mesh.vertices[loose[0]].tolist()} has "
            f"none ({loose.size} such). Repair with drop_unreferenced."
        )
