"""Laplacians from a Gaussian kernel: on meshes of any dimension, on samples, and on known surfaces."""

from dataclasses import replace
from math import gamma
from typing import Literal

import numpy as np
from scipy.sparse.linalg import LinearOperator

from certeig.kit.arguments import require_choice, require_type
from certeig.kit.arrays import positive_values
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._vectors import size_one
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.samples.quadrature import Quadrature, shape_quadrature
from eigenshape.geometry.samples.spacing import neighbor_distance
from eigenshape.geometry.simplices import mean_side_length, require_span
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import vertex_components
from eigenshape.operators.choices import Correction, Distance, Form
from eigenshape.operators.clouds.cell_grid import cell_grid, gaussian_differences
from eigenshape.operators.clouds.kernel import (
    KernelOptions,
    choose_kernel,
    kernel_laplacian,
    require_whole,
    warn_of_few,
    warn_of_narrow,
)
from eigenshape.operators.laplacian import Laplacian

# t of the pointwise rule over e R on a surface: of 0.1, 0.2, 0.3, 0.5 and 0.8 the best for L f on
# random points of the sphere. On even and noisy ones 0.2 is better by up to 1.5 times
# (experiments/ch2_pointwise).
POINTWISE = 0.3


def mesh_laplacian(  # noqa: PLR0913 - one keyword for each choice that the method leaves open
    shape: MeshLike,
    *,
    t: float | Literal["pointwise"] | None = None,
    h: float | None = None,
    edge_factor: float | None = None,
    correct: Correction | None = None,
    form: Form = "literal",
    distance: Distance = "euclidean",
    cutoff: float = 4.0,
) -> Laplacian:
    """Build the mesh Laplacian of Belkin, Sun and Wang, with a Gaussian kernel.

    L f(x_i) = 1/(t (4πt)^{m/2}) Σ_j A_j exp(-|x_i - x_j|²/4t) (f_i - f_j)

    (thesis 2.1; Belkin, Sun, Wang 2008), with A_j the volume around point j, as the symmetric
    pencil W_ij = -A_i A_j G_ij / t, B = diag(A). The operator is robust to noise. Its kernel uses
    Euclidean distance, so heat leaks between limbs that are close to each other. On flat space the
    operator is (1 - e^{-tΔ})/t, whose eigenvalues are below those of Δ.

    Whether the operator converges depends on how t decreases as the mesh gets finer. Let ε be the
    fineness of a mesh with its vertices on a smooth manifold. L f converges to Δf at every point
    for t = ε^{1/(2.5 + α)}, α > 0 (Belkin, Sun, Wang 2008; thesis 2.1.1), and each eigenvalue
    converges if t and ε / t^{m/2 + 3} go to 0 (thesis 3.1.3). In both cases t decreases far more
    slowly than e².

    With the default, t = e², no such theorem holds, and L f does not converge: the kernel always
    sees the same number of points, and the error of their weights A_j is divided by t. On 1,000 to
    64,000 random points of the unit sphere the largest error of L z, which should be 2z, grows from
    1.3 to 14; with t = 0.1 e, in units of the radius, it decreases from 1.9 to 0.3.
    `t="pointwise"` takes the t of `pointwise_time`, which is best for L f. Eigenvalues are
    more accurate, because the errors of weights average out: on 1,000 to 16,000 even points of the
    sphere the median error of 300 eigenvalues decreases from 0.6 to 0.07, and with `correct="log"`
    from 0.012 to 0.0007. That is measured, not proved (docs/operators.md; experiments/ch3_sphere).

    Parameters
    ----------
    shape : MeshLike
    t, h, edge_factor : float, optional
        The scale, by one of three names: heat time t in length²; width h = 2√t in length; or h over
        the mean length e of the sides of all simplices. The default is h = 2e, which is t = e².
    correct : {None, "log"}
        "log": solvers report λ = -log(1 - t μ)/t for an eigenvalue μ of the pencil, which removes
        the bias.
    form : {"literal", "random-walk"}
        The mass of point i: A_i, or the volume that the kernel sees there, A_i Σ_j G_ij A_j. With
        `correct`, the second form is least sensitive to noise on the vertices.
    distance : {"euclidean", "geodesic"}
        Distance in the kernel. Geodesic distance (on surfaces) does not leak between limbs.
    cutoff : float
        Distance, in widths h, beyond which the kernel is set to zero. The value 4 changes
        eigenvalues by 2e-6 of themselves, 3 by 0.12 %.

    Returns
    -------
    Laplacian
        W in length^(m-2), B in length^m, and `kernel` with the scale.

    Raises
    ------
    InvalidParameterError
        If more than one scale is given, one is not positive, another text than "pointwise" is
        given, or h < e.
    InvalidShapeError
        If a simplex has no volume or the same corners as another, a point belongs to no simplex,
        the kernel graph of a component is not connected, or the matrix needs more than half of the
        memory.

    Warns
    -----
    UserWarning
        If h < 1.5 e, or t is so large that fewer than ten eigenvalues can be distinguished (not for
        "pointwise").

    See Also
    --------
    point_cloud_laplacian : The same kernel on points without triangles.
    cotangent_laplacian : Linear elements; faster and sparser.

    Examples
    --------
    >>> import eigenshape as es
    >>> laplacian = es.mesh_laplacian(es.icosphere(3), correct="log")
    >>> es.solve_spectrum(laplacian, 4).eigenvalues.round(1).tolist()
    [0.0, 2.0, 2.0, 2.0]
    >>> round(laplacian.kernel.edge_factor, 6)
    2.0
    """
    shape = as_simplicial(shape, "shape")
    require_choice(distance, Distance, "distance")
    if isinstance(t, str) and t != "pointwise":
        raise InvalidParameterError(f"t must be a heat time or 'pointwise'; it is {t!r}.")
    measure = shape_quadrature(shape)
    time = pointwise_time(shape) if t == "pointwise" else t
    kernel = choose_kernel(
        KernelOptions(time, h, edge_factor, correct, form, cutoff), mean_side_length(shape)
    )
    warn_of_narrow(kernel)
    if t != "pointwise":
        warn_of_few(measure, kernel)
    laplacian = kernel_laplacian(measure, kernel, shape if distance == "geodesic" else None)
    require_whole(laplacian, vertex_components(shape)[1], kernel)
    return laplacian


def pointwise_time(shape: MeshLike) -> float:
    """Return the heat time at which the mesh Laplacian of a shape is best applied to functions.

    t = 0.3 R² (e/R)^p,   p = (2m + 8)/(m + 10)

    with e the mean length of sides and R the radius of the m-sphere of the same volume. On a
    surface p = 1 and t = 0.3 e R, R = √(area / 4π).

    The rule balances two errors of L f at a point. The bias of the kernel is proportional to t. The
    sum over points is the integral of an interpolant, which on a simplex errs by e^{m+2} g'' for
    the integrand g = G (f(x) - f(y))/t, g'' ~ t^{-m/2 - 3/2}. On irregular meshes these errors have
    random signs, and the (√t/e)^m of them under the kernel add up to e^{m/2 + 2} t^{-m/4 - 3/2}. On
    a surface that is e³/t². Both are equal at the stated power of e, and then the error of L f is
    proportional to t: to e on a surface, or n^{-1/2}. Theorem 2.1.1 of the thesis allows any mesh,
    also one whose errors all have the same sign, and so asks for t = ε^{1/(2.5 + α)}. The factor
    0.3 is measured on spheres (experiments/ch2_pointwise).

    Parameters
    ----------
    shape : MeshLike
        Of any dimension m.

    Returns
    -------
    float
        In length².

    Raises
    ------
    InvalidShapeError
        If the shape is no mesh, or has no volume.

    See Also
    --------
    mesh_laplacian : `t="pointwise"` takes this time.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(4)
    >>> e = es.geometry.mean_side_length(mesh)
    >>> round(es.operators.pointwise_time(mesh) / e, 3)  # 0.3 R, and R is nearly 1
    0.3
    """
    shape = as_simplicial(shape, "shape")
    points, scale = size_one(shape.points)
    unit = SimplicialMesh(points, shape.simplices)
    m = unit.dim
    volume = float(shape_quadrature(unit).weights.sum())
    sphere = 2 * np.pi ** ((m + 1) / 2) / gamma((m + 1) / 2)  # volume of the unit m-sphere
    radius = (volume / sphere) ** (1 / m)
    edge = mean_side_length(unit)
    time = POINTWISE * radius**2 * (edge / radius) ** ((2 * m + 8) / (m + 10))
    return time * scale * scale


def gaussian_laplacian(
    points: ArrayLike,
    t: float,
    dim: Integer,
    *,
    correct: Correction | None = None,
    form: Form = "literal",
    cutoff: float = 4.0,
) -> Laplacian:
    """Build the Gaussian-weighted graph Laplacian of points that sample an m-manifold uniformly.

    L f(p_i) = 1/n · 1/(t (4πt)^{m/2}) Σ_j exp(-|p_i - p_j|²/4t) (f_i - f_j)   (thesis eq. 2.1, 2.2)

    This is the mesh Laplacian with weight 1/n at every point. On a manifold of volume V its
    eigenvalues are those of Δ divided by V.

    Parameters
    ----------
    points : (n, d) float
    t : float
        Heat time, in length².
    dim : int
        Dimension m of the manifold, 1 to d.
    correct, form, cutoff
        As in `mesh_laplacian`. A correction needs weights in length^m, as those of
        `quadrature_laplacian`; here it requires the random-walk form, which needs no volume.

    Returns
    -------
    Laplacian
        W in 1/length^(m+2), B, 1/n, without unit.

    Raises
    ------
    InvalidParameterError
        If t is not positive or less than a quarter of the squared distance of neighbors, or dim is
        not in 1..d.
    InvalidShapeError
        If a point is not finite or isolated, two points are equal, all points lie in a flat of
        fewer than m dimensions, or the matrix needs more than half of the memory.

    Examples
    --------
    >>> import eigenshape as es
    >>> points = es.shapes.fibonacci_sphere(500).vertices
    >>> laplacian = es.operators.gaussian_laplacian(points, 0.05, 2)
    >>> laplacian.mass.diagonal().sum().round(9).item()
    1.0
    """
    if correct and form == "literal":
        raise InvalidParameterError(
            "A correction of weights 1/n needs the random-walk form; form is 'literal', whose eigenvalues are divided "
            "by the unknown volume. Choose form='random-walk', or quadrature_laplacian with weights in length^m."
        )
    laplacian = quadrature_laplacian(
        Quadrature(points, None, dim), t, correct=correct, form=form, cutoff=cutoff
    )
    kernel, n = laplacian.kernel, laplacian.n_points
    if kernel is None or form == "random-walk":
        return laplacian
    # Record the volume that the kernel sees: weights in length^m sum to 1 under the kernel.
    itself = (4 * np.pi * kernel.t) ** (-int(dim) / 2) / n
    degrees = kernel.t * laplacian.stiffness.diagonal() * n + itself
    return replace(laplacian, kernel=replace(kernel, volume=float(1 / degrees.mean())))


def quadrature_laplacian(
    measure: Quadrature,
    t: float,
    *,
    correct: Correction | None = None,
    form: Form = "literal",
    cutoff: float = 4.0,
) -> Laplacian:
    """Build the Gaussian Laplacian of points with given weights: the functional 𝓛_t as a pencil.

    Parameters
    ----------
    measure : Quadrature
        Points with weights in length^m.
    t : float
        Heat time, in length².
    correct, form, cutoff
        As in `mesh_laplacian`.

    Returns
    -------
    Laplacian
        W in length^(m-2), B in length^m.

    Raises
    ------
    InvalidParameterError, InvalidShapeError
        As in `mesh_laplacian` and `gaussian_laplacian`.

    Examples
    --------
    >>> import eigenshape as es
    >>> measure = es.geometry.shape_quadrature(es.icosphere(3))
    >>> laplacian = es.operators.quadrature_laplacian(measure, 0.02, correct="log")
    >>> es.solve_spectrum(laplacian, 4).eigenvalues.round(1).tolist()
    [0.0, 2.0, 2.0, 2.0]
    """
    require_type(measure, Quadrature, "measure")
    edge = neighbor_distance(measure.points, measure.dim)
    require_span(measure.points, measure.dim, "The points of a sample")
    kernel = choose_kernel(KernelOptions(t=t, correct=correct, form=form, cutoff=cutoff), edge)
    warn_of_narrow(kernel)
    return kernel_laplacian(measure, kernel)


def functional_laplacian(measure: Quadrature, t: float, *, cutoff: float = 6.0) -> LinearOperator:
    """Build the functional approximation 𝓛_t of Δ as a linear operator, without storing a matrix.

    𝓛_t f(x) = 1/(t (4πt)^{m/2}) ∫ exp(-|x - y|²/4t) (f(x) - f(y)) dy

    (thesis eq. 3.1; Belkin, Niyogi 2008), with the integral evaluated by a quadrature.

    Parameters
    ----------
    measure : Quadrature
        Of a surface whose weights you know, or of a mesh (`shape_quadrature`). On a mesh this is
        the mesh Laplacian without its matrix, for kernels that are too dense to store.
    t : float
        Heat time, in length².
    cutoff : float
        Distance, in widths h, beyond which the kernel is set to zero. Beyond 6 it is below
        rounding.

    Returns
    -------
    LinearOperator
        (n, n), maps values at the points to values of 𝓛_t f there, in 1/length². Self-adjoint in
        the inner product of the weights; multiplied by the weights it is W of
        `quadrature_laplacian`.

    Raises
    ------
    InvalidParameterError
        If t or cutoff is not positive.

    Examples
    --------
    On the unit sphere Δz = 2z; the functional has a bias that vanishes with t:

    >>> import eigenshape as es
    >>> from numpy import median
    >>> measure = es.geometry.shape_quadrature(es.icosphere(4))
    >>> operator = es.operators.functional_laplacian(measure, 0.01)
    >>> z = measure.points[:, 2]
    >>> median((operator @ z)[z > 0.5] / z[z > 0.5]).round(1).item()
    2.0
    """
    require_type(measure, Quadrature, "measure")
    positive_values([t, cutoff], "t and cutoff")
    points, scale = size_one(measure.points)
    time = t / scale / scale
    grid = cell_grid(points, cutoff * 2 * time**0.5)
    weights, unit = size_one(measure.weights)
    factor = (unit / scale**measure.dim) / (4 * np.pi * time) ** (measure.dim / 2) / t

    def product(values: np.ndarray) -> np.ndarray:
        columns = values.astype(np.float64).reshape(len(weights), -1)
        return factor * gaussian_differences(grid, weights, time, columns) / weights[:, None]

    return LinearOperator(
        (len(weights),) * 2,
        matvec=lambda f: product(f).ravel(),
        matmat=product,
        dtype=np.dtype(np.float64),
    )
