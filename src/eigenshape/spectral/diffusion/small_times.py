"""What the heat trace of a surface says at short times: area, boundary length, Euler characteristic."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import finite_values
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import Shown
from certeig.kit.typing import ArrayLike
from eigenshape.operators.choices import Condition
from eigenshape.spectral.requirements import require_lowest
from eigenshape.spectral.spectrum import Spectrum

# Eigenvalues that are needed at least. With fewer, the shortest times are as long as the shape.
FEWEST_EIGENVALUES = 50
# In a list without residuals, an eigenvalue up to this share of the largest is 0: other solvers
# than ours stop at about 1e-8.
ZERO = 1e-7
# The first and last time of the fit, times the largest eigenvalue. Shorter times see the end of the
# list, longer ones see the shape as a whole, which the expansion at t = 0 does not describe. Chosen
# on exact spectra of sphere, flat tori and disc, and on genus 3.
WINDOW = (4.0, 20.0)
OTHER_WINDOW = (2.0, 20.0)
# Where the weight of eigenvalues begins to fall, as a share of the largest √λ.
RAMP = 0.4
OTHER_RAMPS = (0.3, 0.5)
# The stated error is the largest change between fits times this factor: on exact spectra, fits of
# one surface share part of their error.
SAFETY = 2.0
# Times of the fit, in geometric sequence. More of them change nothing: neighbors say the same.
N_TIMES = 40
# Nodes of the Gauss-Legendre quadrature on each piece of √λ. The integrands are smooth there, and
# 40 nodes give all digits.
N_NODES = 60


@dataclass(frozen=True)
class RecoveredGeometry(Shown):
    """Area, boundary length and Euler characteristic of a surface, from its eigenvalues.

    Attributes
    ----------
    area, area_error : float
        In length².
    boundary_length, boundary_length_error : float or None
        In length; None if the surface has no boundary.
    euler_characteristic, euler_characteristic_error : float
        As fitted, not rounded.
    times : (float, float)
        The first and last time of the fit, in length².
    n_eigenvalues : int

    See Also
    --------
    es.spectral.recover_geometry : Recover the geometry.

    Examples
    --------
    The eigenvalues of a sphere of radius 3 tell its area, 36π, and that it has no handles:

    >>> import math
    >>> import eigenshape as es
    >>> found = es.spectral.recover_geometry(es.shapes.sphere_eigenvalues(300) / 9)
    >>> abs(found.area - 36 * math.pi) <= found.area_error
    True
    >>> found.whole_characteristic(even=True)
    2
    """

    area: float
    area_error: float
    boundary_length: float | None
    boundary_length_error: float | None
    euler_characteristic: float
    euler_characteristic_error: float
    times: tuple[float, float]
    n_eigenvalues: int

    def whole_characteristic(self, *, even: bool = False) -> int | None:
        """Return the Euler characteristic as a whole number, or None if the error leaves a choice.

        A number is returned if it is within the stated error of the fitted value, and that
        error is less than half of the distance to the next number.

        Parameters
        ----------
        even : bool
            Only even numbers are possible. This is so for closed orientable surfaces, of which
            2 - 2g belongs to g handles; the error may then be twice as large.
        """
        step = 2 if even else 1
        nearest = step * round(self.euler_characteristic / step)
        away = abs(self.euler_characteristic - nearest)
        error = self.euler_characteristic_error
        return nearest if away <= error < step / 2 else None

    def explain(self) -> str:
        """Return a text that says what was recovered, and how surely."""
        parts = [f"area {self.area:.6g} ± {self.area_error:.2g}"]
        if self.boundary_length is not None:
            parts.append(f"boundary {self.boundary_length:.5g} ± {self.boundary_length_error:.2g}")
        characteristic = f"{self.euler_characteristic:.3g} ± {self.euler_characteristic_error:.2g}"
        whole, even = self.whole_characteristic(), self.whole_characteristic(even=True)
        if whole is not None:
            conclusion = f"which leaves the whole number {whole}"
        elif self.boundary_length is None and even is not None:
            conclusion = (
                f"which leaves several whole numbers, of which only {even} is even, as that of a "
                f"closed orientable surface is"
            )
        else:
            conclusion = "which does not determine a whole number"
        return (
            f"{self.n_eigenvalues} eigenvalues give {', '.join(parts)}, and Euler characteristic "
            f"{characteristic}, {conclusion}."
        )


def recover_geometry(
    eigenvalues: Spectrum | ArrayLike,
    *,
    boundary: Condition | None = None,
    errors: ArrayLike | None = None,
) -> RecoveredGeometry:
    """Recover area, boundary length and Euler characteristic of a surface from its eigenvalues.

    Z(t) = A/(4πt) ± L/(8√(πt)) + χ/6 + ...  as t → 0, + with the Neumann, - with the Dirichlet
    condition (Kac 1966; McKean, Singer 1967). The next term is of order √t, and of order t without
    boundary.

    Cut off after k eigenvalues, Z misses most at the short times that count. So each eigenvalue
    gets a weight that falls smoothly from 1 at 0.4 √λ_k to 0 at √λ_k, and so does the density
    A/4π ± L/(8π√λ) of eigenvalues that belongs to the first two terms. Then A, L, χ and the next
    term are fitted to Σ weight exp(-t λ) at times from 4/λ_k to 20/λ_k. The smooth weight averages
    over the fluctuations of the counting function: on the exact spectrum of a sphere a sharp end of
    the list gives χ with an error of 0.2, and the weight with one of 0.001.

    The stated errors are twice the largest change if a further term is fitted, the times begin at
    2/λ_k, or the weight begins to fall at 0.3 or 0.5 √λ_k. They are estimates, not bounds. They
    do not contain the errors of the eigenvalues, unless `errors` is given: linear elements on
    10,000 points have 1 % at the 300th, far too much. Use `es.operators.fem_laplacian` of order 2 or
    3. Of thin or sharply curved shapes more eigenvalues are needed: √(20/λ_k) must be below half of
    the narrowest width. A corner of angle α at the boundary adds (π² - α²)/(4πα) to χ, and the
    straight sides beside it nothing: a square gives 1.5.

    Parameters
    ----------
    eigenvalues : Spectrum or (k,) float
        The k lowest eigenvalues of a surface, ascending, in 1/length²; at least 50.
    boundary : {None, "neumann", "dirichlet"}
        The condition at the boundary; None if the surface has no boundary.
    errors : (k,) float, optional
        Estimated errors of the eigenvalues, in 1/length², such as a quarter of the differences
        between elements of order 2 and 3, for the eigenvalues of order 3. The change that they
        make, all at once with their signs, is added to the stated errors.

    Returns
    -------
    RecoveredGeometry

    Raises
    ------
    InvalidParameterError
        If there are less than 50 eigenvalues, they are not finite, ascending and ≥ 0, the first is
        0 with the Dirichlet condition or not 0 otherwise, `boundary` is unknown, or `errors` has
        another length.

    Examples
    --------
    >>> import eigenshape as es
    >>> found = es.spectral.recover_geometry(es.shapes.sphere_eigenvalues(300))
    >>> round(found.area, 2), round(found.euler_characteristic, 2)  # 4π and 2
    (12.57, 2.0)
    >>> print(found.explain()[-32:])
    which leaves the whole number 2.
    """
    if boundary is not None:
        require_choice(boundary, Condition, "boundary")
    values = _require_eigenvalues(eigenvalues, boundary)
    top = values[-1]
    base = _fit(values / top, boundary)
    variants = [
        _fit(values / top, boundary, n_terms=2),
        _fit(values / top, boundary, window=OTHER_WINDOW),
        *(_fit(values / top, boundary, ramp=ramp) for ramp in OTHER_RAMPS),
    ]
    spread = SAFETY * np.abs(np.array(variants) - base).max(axis=0)
    if errors is not None:
        offsets = finite_values(errors, "errors")
        if offsets.shape != values.shape:
            raise InvalidParameterError(
                f"errors must hold one number per eigenvalue, {len(values)}; there are {len(offsets)}."
            )
        moved = np.sort(np.maximum(values - offsets, 0))
        spread += np.abs(_fit(moved / moved[-1], boundary) * _units(moved[-1] / top) - base)
    units = _units(top)
    area, length, characteristic = (float(value) for value in base * units)
    of_area, of_length, of_characteristic = (float(value) for value in spread * units)
    return RecoveredGeometry(
        area=area,
        area_error=of_area,
        boundary_length=None if boundary is None else length,
        boundary_length_error=None if boundary is None else of_length,
        euler_characteristic=characteristic,
        euler_characteristic_error=of_characteristic,
        times=(WINDOW[0] / float(top), WINDOW[1] / float(top)),
        n_eigenvalues=len(values),
    )


def _units(top: float) -> Float[np.ndarray, "3"]:
    """Return the units of area, length and Euler characteristic if `top` is the unit of eigenvalues."""
    return np.array([1 / top, 1 / np.sqrt(top), 1.0])


def _require_eigenvalues(
    eigenvalues: Spectrum | ArrayLike, boundary: Condition | None
) -> Float[np.ndarray, " k"]:
    spectrum = None
    if isinstance(eigenvalues, Spectrum):
        spectrum = eigenvalues
        require_lowest(spectrum, "eigenvalues")
        eigenvalues = spectrum.eigenvalues
    values = finite_values(eigenvalues, "eigenvalues")
    if len(values) < FEWEST_EIGENVALUES:
        raise InvalidParameterError(
            f"At least {FEWEST_EIGENVALUES} eigenvalues are needed to see short times; there are {len(values)}. "
            "Increase k."
        )
    bad = np.flatnonzero(np.diff(values, prepend=0.0) < 0)
    if bad.size:
        raise InvalidParameterError(
            f"eigenvalues must be ascending and at least 0; entry {bad[0]} is {values[bad[0]]:.6g}."
        )
    n_small = int(np.count_nonzero(values <= ZERO * values[-1]))
    n_zero = n_small if spectrum is None else spectrum.n_zero_modes
    if boundary == "dirichlet" and n_zero:
        raise InvalidParameterError(
            f"With the Dirichlet condition no eigenvalue is 0; {n_zero} are. Pass fixed= to "
            "solve_spectrum, or boundary='neumann'."
        )
    if boundary != "dirichlet" and not n_zero:
        raise InvalidParameterError(
            f"The first eigenvalue must be 0, that of constants; it is {values[0]:.6g}. Pass the "
            "spectrum from its beginning, or boundary='dirichlet'."
        )
    return values


def _fit(
    values: Float[np.ndarray, " k"],
    boundary: Condition | None,
    *,
    n_terms: int = 1,
    window: tuple[float, float] = WINDOW,
    ramp: float = RAMP,
) -> Float[np.ndarray, "3"]:
    """Fit A, L and χ to eigenvalues whose largest is 1, with n further terms; L is 0 without boundary."""
    times = np.geomspace(*window, N_TIMES)
    traces = _weights(np.sqrt(values), ramp) @ np.exp(-np.outer(values, times))
    # ∫ weight exp(-tλ) of the densities of eigenvalues 1 and 1/√λ, in √λ = v: dλ = 2v dv.
    ends = np.array([0, ramp, 1])
    nodes, shares = np.polynomial.legendre.leggauss(N_NODES)
    middles, halves = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    v = (middles[:, None] + halves[:, None] * nodes).ravel()
    density = 2 * (halves[:, None] * shares).ravel() * _weights(v, ramp)
    decay = np.exp(-np.outer(v**2, times)).T
    columns = [decay @ (density * v) / (4 * np.pi), np.full(N_TIMES, 1 / 6)]
    if boundary is not None:
        sign = 1 if boundary == "neumann" else -1
        columns.insert(1, sign * (decay @ density) / (8 * np.pi))
    power = 1.0 if boundary is None else 0.5
    further = (times / times.mean())[:, None] ** (power * np.arange(1, n_terms + 1))
    table = np.column_stack([*columns, further])
    # Equal weights of the relative errors of A would be t; √t leaves more of them to short times.
    fitted = np.linalg.lstsq(table * np.sqrt(times)[:, None], traces * np.sqrt(times), rcond=None)[
        0
    ]
    if boundary is None:
        return np.array([fitted[0], 0.0, fitted[1]])
    return fitted[:3].copy()


def _weights(roots: Float[np.ndarray, " k"], ramp: float) -> Float[np.ndarray, " k"]:
    """Return weights that fall from 1 at `ramp` to 0 at 1, with two continuous derivatives."""
    share = np.clip((roots - ramp) / (1 - ramp), 0, 1)
    return 1 - share**3 * (10 - 15 * share + 6 * share**2)
