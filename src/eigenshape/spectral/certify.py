"""The proof that eigenpairs from elsewhere are the lowest ones of an operator."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import as_array
from certeig.kit.errors import ConvergenceError
from certeig.kit.threads import one_blas_thread
from certeig.solver.certify import certify_pairs
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.kernel_values import to_pencil, user_certificate
from eigenshape.spectral.pencils import normalize


def certify(
    laplacian: Laplacian,
    eigenvalues: Float[np.ndarray, " k"],
    eigenvectors: Float[np.ndarray, "n k"],
) -> Certificate:
    """Prove that given eigenpairs are the k lowest ones of an operator, or raise an error.

    By Sylvester's law of inertia (Parlett 1998, section 3.3), D in W - σB = L D Lᵀ has as many
    negative entries as there are eigenvalues below σ. σ is placed just above the k-th eigenvalue,
    farther away than the rounding of the factor can change the count.

    Parameters
    ----------
    laplacian : Laplacian
    eigenvalues : (k,) float
        Ascending, in 1/length².
    eigenvectors : (n, k) float
        B-orthonormal columns.

    Returns
    -------
    Certificate

    Raises
    ------
    InvalidParameterError
        If the arrays do not fit the operator, or are not finite or not ascending.
    ConvergenceError
        If the columns are not B-orthonormal eigenvectors, or the number of eigenvalues differs.

    See Also
    --------
    solve_spectrum : Compute eigenpairs with their certificate.

    Examples
    --------
    Certify the result of another solver:

    >>> import eigenshape as es
    >>> from scipy.linalg import eigh
    >>> laplacian = es.cotangent_laplacian(es.icosphere(1))
    >>> values, vectors = eigh(laplacian.stiffness.toarray(), laplacian.mass.toarray())
    >>> es.spectral.certify(laplacian, values[:4], vectors[:, :4]).complete
    True
    """
    require_type(laplacian, Laplacian, "laplacian")
    values = to_pencil(laplacian.kernel, as_array(eigenvalues, "eigenvalues"))
    with one_blas_thread():
        found, last = certify_pairs(normalize(laplacian), values, eigenvectors)
    certificate = user_certificate(laplacian.kernel, found, last)
    if not certificate.complete:
        raise ConvergenceError(certificate.explain())
    return certificate
