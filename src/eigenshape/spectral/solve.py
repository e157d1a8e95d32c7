"""The eigenpairs of a Laplacian: the lowest ones or those of an interval, certified or approximate."""

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Int

import certeig
from certeig.kit.arguments import require_choice, require_type
from certeig.kit.arrays import as_interval, freeze, positive_number, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.files import as_path, require_writable
from certeig.kit.matrices import on_all_rows
from certeig.kit.progress import Progress, silent
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from certeig.solver.certified import certified_pairs
from certeig.solver.eigenpairs import Pairs
from certeig.solver.pencil import Pencil
from eigenshape.operators.laplacian import Laplacian, dirichlet_laplacian
from eigenshape.spectral.cache import content_key, keep, load_kept
from eigenshape.spectral.kernel_values import (
    from_pencil,
    require_readable,
    to_pencil,
    user_certificate,
    user_residuals,
)
from eigenshape.spectral.multilevel.approximate import (
    approximate_pairs,
    require_accuracy,
    require_lumped,
)
from eigenshape.spectral.pencils import LARGEST, normalize
from eigenshape.spectral.spectrum import Spectrum

Method = Literal["certified", "approximate"]

# Relative error of approximate eigenvalues by default.
DEFAULT_ACCURACY = 1e-3
# Smallest `accuracy` and `max_residual` that can be requested; below it rounding dominates.
LEAST_ACCURACY = 1e-10
# Negative eigenvalues down to minus this share of the mean eigenvalue may be rounding.
NEGATIVE_ROUNDING = 1e-9


def solve_spectrum(  # noqa: PLR0913 - one keyword for each choice: which pairs, how, and where kept
    laplacian: Laplacian,
    k: Integer | None = None,
    *,
    fixed: ArrayLike | None = None,
    below: float | None = None,
    above: float | None = None,
    method: Method = "certified",
    accuracy: float | None = None,
    max_residual: float | None = None,
    progress: Progress | None = None,
    cache: str | Path | None = None,
) -> Spectrum:
    """Compute the lowest eigenpairs of a Laplacian, W φ = λ B φ, or all eigenpairs in an interval.

    The certified method proves that no eigenvalue is missing. It runs block Lanczos on (W - σB)⁻¹B
    with σ among the wanted eigenvalues, counts the eigenvalues below a gap by Sylvester's law of
    inertia (Parlett 1998, section 3.3), and searches for what is missing until both counts agree.
    Small operators are solved densely. Operators with a hundred entries a row or more, such as
    kernels, are not factored: Lanczos runs on a Chebyshev polynomial (Zhou, Saad, Tiago and
    Chelikowsky 2006), and eigenvalues are counted in a sparser operator below the given one.

    The approximate method factors nothing of full size and proves nothing. It aggregates points
    (Vaněk, Mandel and Brezina 1996), solves the coarsest level exactly, and refines the
    eigenvectors level by level by block Davidson iteration, in the spirit of Nasikun and
    Hildebrandt (2022). It needs less memory, and less time for a few dozen pairs of many points. Up
    to 100,000 points, with less than a hundred entries a row, the certified method is as fast: there
    it is taken in place of the approximate one, and meets every accuracy.

    Results do not depend on units: coordinates scaled by s give the eigenvalues divided by s².

    Parameters
    ----------
    laplacian : Laplacian
        Any operator with W positive semidefinite and B positive definite; B diagonal for the
        approximate method.
    k : int, optional
        Number of eigenpairs, 1 to the number of free points. Either `k` or `below` must be given.
    fixed : (c,) int, optional
        Points where functions are zero; duplicates are allowed. With the boundary of a mesh fixed
        this is the Dirichlet condition. Points that are not fixed are free (Neumann condition).
    below : float, optional
        Compute all pairs with λ < below, in 1/length². Certified method only.
    above : float, optional
        With `below`: compute all pairs with above ≤ λ < below. `certificate.first` is the number of
        eigenvalues below `above`.
    method : {"certified", "approximate"}
    accuracy : float, optional
        Approximate method only: estimated error of the eigenvalues at which the solver stops,
        relative to the k-th eigenvalue, 1e-10 to 0.1. The default is 1e-3. `certificate.estimate`
        holds the estimate that was reached.
    max_residual : float, optional
        Approximate method only: continue until every residual, relative to the k-th eigenvalue, is
        at most this value too. The residual bounds the error rigorously, and is much larger than
        the error, which is proportional to its square.
    progress : callable, optional
        Called as progress(fraction_done, message) while the solver works.
    cache : path, optional
        Folder in which spectra are kept, each under a hash of W, B and the request. A spectrum
        found there is loaded instead of computed. The folder is created if it does not exist, and
        nothing in it is deleted.

    Returns
    -------
    Spectrum
        Eigenvalues in 1/length², ascending and ≥ 0, and eigenvectors on all n points, zero at the
        fixed ones. An eigenvalue that is negative by less than its residual is reported as 0. If k
        cuts a multiple eigenvalue, `certificate.n_split` is the number of copies left out. If the
        operator's kernel is corrected, eigenvalues, residuals and certificate hold λ = -log(1 - t
        μ)/t for the eigenvalue μ of the pencil. Approximate results have `certificate.complete`
        False and `certificate.count` None, unless the certified method was taken in their place.

    Raises
    ------
    InvalidParameterError
        If not exactly one of `k` and `below` is given; `k` is not in 1..n; no eigenvalue is in the
        interval; a fixed point is out of range or no point is free; the options do not fit the
        method; B is not positive definite or W has a negative eigenvalue; an eigenvalue to be
        corrected is 1/t or more; the entries of the operator span too many orders of magnitude; the
        memory is too small; or the folder `cache` cannot be written to.
    ConvergenceError
        If the proof cannot be completed, or the accuracy is not reached. Incomplete spectra are
        never returned as complete.

    Warns
    -----
    UserWarning
        If eigenvalues of a kernel operator are too close to 1/t to represent the shape, or a file
        in `cache` is damaged and the spectrum is computed again.

    See Also
    --------
    bracket_eigenvalues : Guaranteed bounds for the eigenvalues of the mesh itself.
    heat_kernel_signature, wave_kernel_signature : Signatures of points from a spectrum.

    Examples
    --------
    The first eigenvalues of the unit sphere are 0, 2, 2, 2, 6, ...

    >>> import eigenshape as es
    >>> laplacian = es.cotangent_laplacian(es.icosphere(3), "averaged")
    >>> spectrum = es.solve_spectrum(laplacian, 5)
    >>> spectrum.eigenvalues.round(1).tolist()
    [0.0, 2.0, 2.0, 2.0, 6.0]
    >>> spectrum.certificate.complete
    True

    All eigenvalues in an interval:

    >>> len(es.solve_spectrum(laplacian, above=1.0, below=7.0).eigenvalues)
    8

    The Dirichlet condition on the unit square, where λ₁ = 2π²:

    >>> square = es.shapes.grid(20, 20)
    >>> rim = es.geometry.boundary_vertices(square)
    >>> drum = es.solve_spectrum(es.cotangent_laplacian(square), 1, fixed=rim)
    >>> (drum.eigenvalues / (2 * 3.14159**2)).round(2).tolist()
    [1.0]

    Of few points, approximate eigenpairs are certified:

    >>> ball = es.cotangent_laplacian(es.icosphere(3))
    >>> es.solve_spectrum(ball, 9, method="approximate").certificate.complete
    True
    """
    require_type(laplacian, Laplacian, "laplacian")
    interval = as_interval(k, above, below, _end_of_interval)
    _require_fitting_options(method, below, accuracy, max_residual)
    operator, free = laplacian, None
    if fixed is not None and np.size(fixed):
        operator, free = dirichlet_laplacian(laplacian, fixed)
    wanted = 0 if k is None else whole_number(k, "k", 1, operator.n_points)
    if k is None:
        interval = to_pencil(operator.kernel, interval)
    error = DEFAULT_ACCURACY if accuracy is None else float(accuracy)
    residual = np.inf if max_residual is None else float(max_residual)
    request: tuple[str | float, ...] = (wanted, *interval.tolist())
    if method == "approximate":
        require_lumped(operator)
        request = (method, wanted, error, residual)

    key = ""
    if cache is not None:
        cache = as_path(cache, "cache")
        # Only the free part of the operator is hashed and kept: it determines the spectrum.
        key = content_key(operator, request)
        kept = load_kept(cache, key)
        if kept is not None:
            return _on_all_points(kept, laplacian, free)
        require_writable(cache)  # before the work, not after it

    report = progress or silent
    with one_blas_thread():
        report(0.0, "scaling the operator")
        pencil = normalize(operator)
        if method == "certified":
            pairs, certificate = certified_pairs(pencil, wanted, interval, report)
        else:
            pairs, certificate = approximate_pairs(pencil, wanted, error, residual, report)
    report(1.0, "proved complete" if certificate.complete else "accurate enough")
    spectrum = spectrum_of(operator, pencil, pairs, certificate)
    if wanted > 1 and not spectrum.eigenvalues.any():
        warnings.warn(
            f"All {wanted} eigenvalues are 0: the shape is in {wanted} pieces or more, each of which "
            f"has one. Ask for more of them. Try {LARGEST}: it joins pieces that lie edge on edge, "
            "and drops others.",
            stacklevel=2,
        )
    if cache is not None:
        keep(spectrum, cache, key)
    return _on_all_points(spectrum, laplacian, free)


def _end_of_interval(value: float, name: str) -> float:
    """Return an end of an interval of eigenvalues; from 0 on are all, also those that rounding makes negative."""
    return -np.inf if name == "above" and value == 0 else positive_number(value, name)


def _require_fitting_options(
    method: str,
    below: float | None,
    accuracy: float | None,
    max_residual: float | None,
) -> None:
    """Raise an error if options are given that do not go together."""
    require_choice(method, Method, "method")
    if method == "approximate" and below is not None:
        raise InvalidParameterError(
            f"method='approximate' needs k, because it cannot count the eigenvalues below a value; below is "
            f"{below}. Pass k instead of below, or method='certified'."
        )
    for name, value in (("accuracy", accuracy), ("max_residual", max_residual)):
        if value is None:
            continue
        if method == "certified":
            raise InvalidParameterError(
                f"{name} is for method='approximate'; it is {value} and the method is 'certified', which computes "
                f"eigenvalues to rounding. Leave out {name}, or pass method='approximate'."
            )
        require_accuracy(name, value, LEAST_ACCURACY)


def spectrum_of(
    laplacian: Laplacian, pencil: Pencil, pairs: Pairs, certificate: certeig.Certificate
) -> Spectrum:
    """Convert pairs of the pencil to a spectrum in the user's units, corrected if the kernel is."""
    # A negative Rayleigh quotient proves a negative eigenvalue, however large its residual, up to
    # rounding.
    rounding = (
        np.minimum(4 * pairs.residuals, NEGATIVE_ROUNDING * pencil.level) + 1e-14 * pencil.level
    )
    bad = np.flatnonzero(pairs.values < -rounding)
    if bad.size:
        value, bound = pencil.values_out(np.array([pairs.values[bad[0]], rounding[bad[0]]]))
        raise InvalidParameterError(
            f"stiffness must be positive semidefinite; eigenvalue {bad[0]} is {value:.6g}, with "
            f"an error below {bound:.1e}."
        )
    kernel = laplacian.kernel
    values = pencil.values_out(np.maximum(pairs.values, 0.0))
    residuals = pencil.values_out(pairs.residuals)
    require_readable(kernel, values, stacklevel=4)
    return Spectrum(
        eigenvalues=freeze(from_pencil(kernel, values)),
        eigenvectors=pencil.to_user_vectors(pairs.vectors),
        mass=laplacian.mass,
        residuals=freeze(user_residuals(kernel, values, residuals)),
        certificate=user_certificate(
            kernel, pencil.certificate_out(certificate), float(values[-1])
        ),
    )


def _on_all_points(
    spectrum: Spectrum, laplacian: Laplacian, free: Int[np.ndarray, " f"] | None
) -> Spectrum:
    """Extend eigenvectors of the free points by zeros at the fixed ones."""
    if free is None:
        return spectrum
    vectors = on_all_rows(spectrum.eigenvectors, free, laplacian.n_points)
    return replace(spectrum, eigenvectors=vectors, mass=laplacian.mass)
