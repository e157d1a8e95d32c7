"""Bounds of the effect of rounding on the eigenvalues of a finite-element pencil."""

import numpy as np
from jaxtyping import Float

from eigenshape.geometry.simplices import scaled_corners, triangular_sides
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.laplacian import Laplacian
from eigenshape.sparse.symmetric_factor import EPS
from eigenshape.spectral.spectrum import Spectrum


def enclose(
    spectrum: Spectrum, laplacian: Laplacian, floor: float, relative: float
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return lower and upper bounds for the eigenvalues of the pencil in exact arithmetic, in 1/length².

    The errors of all eigenvalues, matched one to one, are at most √2 times the norm of the
    residuals (Kahan 1967; Parlett 1998, theorem 11.5.1), plus the lack of orthonormality of the
    vectors. The absolute rounding errors, in sums over rows and in the residuals, are at most (row
    length + 4) eps times the largest row of |W| over B.

    Parameters
    ----------
    spectrum : Spectrum
    laplacian : Laplacian
        The operator of the spectrum, without boundary conditions.
    floor : float
        c with B ≥ c diag(B).
    relative : float
        `relative_rounding` of the mesh.
    """
    values = spectrum.eigenvalues
    askew = 2 * len(values) * spectrum.certificate.orthonormality * values[-1]
    stray = np.sqrt(2) * float(np.linalg.norm(spectrum.residuals)) + askew
    rows = abs(laplacian.stiffness).sum(axis=1) / laplacian.mass.diagonal()
    longest_row = int(np.diff(laplacian.stiffness.indptr).max())
    stray += (longest_row + 4) * EPS * float(rows.max()) / floor
    # With slivers rounding may exceed the eigenvalue: then the lower bound is 0.
    lower = np.maximum(values - stray, 0.0) * max(1 - relative, 0.0)
    return lower, (values + stray) * (1 + relative)


def relative_rounding(mesh: Mesh) -> float:
    """Bound the relative error that the rounded entries of linear elements cause in every eigenvalue.

    An error ε |∇λ_a| |∇λ_b| V in each product V ∇λ_a·∇λ_b changes Σ w_ab (u_a - u_b)², which is V
    |∇u|², by at most ε q of itself, q = Σ |e_ab|² |∇λ_a| |∇λ_b| over the edges: 4 on an equilateral
    triangle, the square of the aspect ratio on a flat one. Sides, their triangle and its inverse
    err like linear maps that are within eps q of the identity. Counted together that is below 4
    (m+1)² (d + t) eps q, with t simplices at most around an edge. The coordinates as stored are
    taken for exact.
    """
    corners, _ = scaled_corners(mesh)
    edges = mesh.simplices[:, np.column_stack(np.triu_indices(mesh.dim + 1, 1))].reshape(-1, 2)
    _, n_around = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    terms = corners.shape[2] + int(n_around.max())
    inner = np.linalg.inv(triangular_sides(corners)[1])
    gradients = np.linalg.norm(
        np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1), axis=2
    )
    first, second = np.triu_indices(corners.shape[1], 1)
    squares = ((corners[:, first] - corners[:, second]) ** 2).sum(axis=2)
    flatness = (squares * gradients[:, first] * gradients[:, second]).sum(axis=1)
    return float(4 * (mesh.dim + 1) ** 2 * terms * EPS * flatness.max())
