"""The matrix of a Gaussian kernel on weighted points, its scale, and the Laplacian that it makes.

W_ij = -w_i w_j G(x_i, x_j) / t with G(x, y) = exp(-|x - y|²/4t) / (4πt)^{m/2}: one formula,
whatever the weights are.
"""

import warnings
from dataclasses import dataclass
from math import gamma, pi

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import positive_values
from certeig.kit.errors import InvalidParameterError
from certeig.kit.memory import require_memory
from eigenshape._corners import LARGEST_EXPONENT
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one
from eigenshape.geometry.distances.geodesic import geodesic_balls
from eigenshape.geometry.samples.quadrature import Quadrature
from eigenshape.geometry.samples.spacing import neighbor_distance
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.choices import Correction, Form
from eigenshape.operators.clouds.cell_grid import cell_grid, count_partners, gaussian_rows
from eigenshape.operators.clouds.pair_loops import component_labels
from eigenshape.operators.laplacian import GaussianKernel, Laplacian

# Width of a kernel by default, h / e; t = e².
EDGE_FACTOR = 2.0
# Narrowest kernel, h / e: at half of it eigenvalues are half as large even on the most regular
# points.
NARROWEST = 1.0
# h / e below which eigenvalues of irregular points are 5 % too low or worse.
NARROW = 1.5
# Eigenvalues that can be distinguished at least, without a warning.
FEWEST_PAIRS = 10
# t λ up to which the correction distinguishes one eigenvalue from the next.
LAST = 2.9
# Rows from which the number of entries of the matrix is estimated.
SAMPLED_ROWS = 512
# Bytes per entry while the matrix is built and checked.
PEAK = 30
# It joins each point with its nearest ones, whatever the spacing.
OR_ROBUST = "On a surface in R^3 robust_laplacian(shape) fits any spacing; on the command line, --operator robust."


class UnevenSpacingError(InvalidShapeError):
    """A kernel of one width does not reach the neighbors of all points."""


@dataclass(frozen=True)
class KernelOptions:
    """Options of a kernel, as in `mesh_laplacian`."""

    t: float | None = None
    h: float | None = None
    edge_factor: float | None = None
    correct: Correction | None = None
    form: Form = "literal"
    cutoff: float = 4.0


def choose_kernel(options: KernelOptions, edge: float) -> GaussianKernel:
    """Return the kernel of a heat time t, a width h = 2√t, or a width in mean edge lengths e (default 2e).

    Raise InvalidParameterError if more than one is given, one is not positive, another option is
    unknown, or the kernel is narrower than the points lie.
    """
    scales = {"t": options.t, "h": options.h, "edge_factor": options.edge_factor}
    given = {name: value for name, value in scales.items() if value is not None}
    if len(given) > 1:
        raise InvalidParameterError(
            f"At most one of t, h and edge_factor must be given; given are {given}."
        )
    for name, value in {**given, "cutoff": options.cutoff}.items():
        positive_values(value, name)
    if options.correct not in (None, "log"):
        raise InvalidParameterError(f"correct must be None or 'log'; it is {options.correct!r}.")
    require_choice(options.form, Form, "form")
    width = options.h or (options.edge_factor or EDGE_FACTOR) * edge
    t = options.t or width**2 / 4
    factor = 2 * t**0.5 / edge
    if factor < NARROWEST:
        raise InvalidParameterError(
            f"A kernel must reach the neighbors, h ≥ e; h = 2√t is {factor:.3g} of the mean edge length "
            f"e = {edge:.4g}, t = {t:.4g}. Choose t = e² = {edge**2:.4g}, the default."
        )
    return GaussianKernel(
        t, factor, corrected=options.correct == "log", form=options.form, cutoff=options.cutoff
    )


def kernel_laplacian(
    measure: Quadrature, kernel: GaussianKernel, mesh: Mesh | None = None
) -> Laplacian:
    """Build the Laplacian of the kernel on weighted points.

    Distances are along the surface of `mesh` if it is given, otherwise through space. Raise
    InvalidShapeError if the matrix would not fit into memory or its entries into floats, or a
    point has no partner.
    """
    n = measure.n_points
    points, scale = size_one(measure.points)
    weights, unit = size_one(measure.weights)
    t = kernel.t / scale / scale
    grid = cell_grid(points, kernel.cutoff * 2 * t**0.5)
    # The size of the matrix is estimated from some of its rows. No ball along the surface holds
    # more points than one through space.
    sample = np.unique(np.linspace(0, n - 1, min(n, SAMPLED_ROWS)).astype(np.int64))
    entries = count_partners(grid, sample)[sample].mean() * n
    require_memory(
        "A kernel matrix",
        f"{entries:.2g} entries, {entries / n:.0f} a row,",
        {"values and columns": entries * PEAK},
        "Choose a smaller t, or functional_laplacian, which stores none.",
        share=0.5,
        error=InvalidShapeError,
    )
    if mesh is None:
        counts = count_partners(grid)
        n_partners = counts - 1
    else:
        matrix = geodesic_balls(mesh, kernel.cutoff * kernel.width)
        n_partners = np.diff(matrix.indptr)
    alone = np.flatnonzero(n_partners == 0)
    if alone.size:
        raise UnevenSpacingError(
            f"Every point must have another one within the cutoff of the kernel; point {alone[0]} "
            f"at {measure.points[alone[0]].tolist()} has none within "
            f"{kernel.cutoff * kernel.width:.4g} ({alone.size} such). Choose a larger t than "
            f"{kernel.t:.4g}, or remove such points. {OR_ROBUST}"
        )
    # The entries w_i w_j exp(-d_ij²/4t).
    if mesh is None:
        starts = np.append(0, np.cumsum(counts))
        columns, values = gaussian_rows(grid, weights, t, starts)
        # SciPy gives indices and pointers one type, the longer one.
        starts = starts.astype(sp.get_index_dtype(maxval=starts[-1]))
        matrix = sp.csr_array((values, columns, starts), shape=(n, n))
    else:
        heat = np.exp(-((matrix.data / kernel.width) ** 2))
        matrix.data = np.repeat(weights, n_partners) * weights[matrix.indices] * heat
        matrix = matrix + sp.diags_array(weights**2)
    # W is written in the place of the matrix. Weights and coordinates were divided by powers of two.
    of_weight, of_length = (int(np.frexp(each)[1]) - 1 for each in (unit, scale))
    t = float(np.ldexp(kernel.t, -2 * of_length))
    matrix.data /= (4 * pi * t) ** (measure.dim / 2)
    exponent = 2 * of_weight - measure.dim * of_length
    mass = measure.weights
    if kernel.form == "random-walk":
        mass = _scale_by_power(matrix.sum(axis=1), exponent)
    matrix.setdiag(0)
    matrix.data /= -t
    matrix.setdiag(-matrix.sum(axis=1))
    matrix.data = _scale_by_power(matrix.data, exponent - 2 * of_length)
    return Laplacian(matrix, sp.diags_array(mass).tocsr(), kernel)


def _scale_by_power(values: Float[np.ndarray, " z"], exponent: int) -> Float[np.ndarray, " z"]:
    if abs(exponent) > LARGEST_EXPONENT:
        raise InvalidShapeError(
            f"Entries of a kernel matrix must be floats; theirs are about 2^{exponent}. Choose another unit."
        )
    if exponent:
        values *= 2.0**exponent
    return values


def time_range(spacing: float, eigenvalue: float, *, corrected: bool) -> tuple[float, float]:
    """Return the heat times from which a kernel reaches neighbors, and up to which it tells an eigenvalue."""
    radius = EDGE_FACTOR * spacing / 2
    reach = radius * radius  # infinite if it overflows, where a power raises an error
    return reach, (LAST if corrected else 0.5) / eigenvalue


def sample_laplacian(
    points: Float[np.ndarray, "n d"], dim: int, t: float, labels: Int[np.ndarray, " n"]
) -> Laplacian:
    """Build the Laplacian of a sample of a shape at a heat time; `labels` number its components.

    Raise an error as `choose_kernel` and `require_whole` do.
    """
    kernel = choose_kernel(KernelOptions(t=t), neighbor_distance(points, dim))
    laplacian = kernel_laplacian(Quadrature(points, None, dim), kernel)
    require_whole(laplacian, labels, kernel)
    return laplacian


def require_whole(laplacian: Laplacian, labels: np.ndarray, kernel: GaussianKernel) -> None:
    """Raise an error if the kernel graph of a component is not connected; `labels` number the components."""
    parts = component_labels(laplacian.stiffness.indptr, laplacian.stiffness.indices)
    pairs = np.unique(np.column_stack([labels, parts]), axis=0)
    torn = np.flatnonzero(np.bincount(pairs[:, 0]) > 1)
    if torn.size:
        raise UnevenSpacingError(
            f"The kernel must connect each component of the shape; at t = {kernel.t:.4g} "
            f"component {torn[0]} falls into "
            f"{np.count_nonzero(pairs[:, 0] == torn[0])} parts ({parts.max() + 1} in all). Choose a larger t. "
            f"{OR_ROBUST}"
        )


def warn_of_narrow(kernel: GaussianKernel, stacklevel: int = 3) -> None:
    """Warn if the kernel hardly reaches the neighbors."""
    if kernel.edge_factor < NARROW:
        warnings.warn(
            f"A kernel of width h = {kernel.edge_factor:.3g} e suits regular points only; on irregular points "
            "eigenvalues are 5 to 20 % too low. The default is h = 2e.",
            stacklevel=stacklevel,
        )


def warn_of_few(measure: Quadrature, kernel: GaussianKernel, stacklevel: int = 3) -> None:
    """Warn if fewer than ten eigenvalues can be distinguished at this t, by Weyl's law."""
    ball = pi ** (measure.dim / 2) / gamma(measure.dim / 2 + 1)
    length = (measure.weights / kernel.t ** (measure.dim / 2)).sum()
    n_pairs = int(length * ball * (LAST / (4 * pi**2)) ** (measure.dim / 2))
    if n_pairs < FEWEST_PAIRS:
        warnings.warn(
            f"With the heat time t = {kernel.t:.4g} about {n_pairs} eigenvalues can be distinguished "
            f"(t λ < {LAST}); k eigenvalues of a surface need n > 5 k t/e² points, and 21 k t/e² without "
            f"correction. Choose a smaller t.",
            stacklevel=stacklevel,
        )
