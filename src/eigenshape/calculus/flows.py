"""Flows that smooth shapes: mean curvature flow, its conformal form, and Taubin's filter."""

import numpy as np
import scipy.sparse as sp

from certeig.kit.arrays import finite_number, positive_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.matrices import require_points
from certeig.kit.progress import Progress, silent
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import step_number
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one
from eigenshape.calculus.linear_solver import factor_definite
from eigenshape.geometry.conversion import MeshLike, as_mesh, as_simplicial
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh
from eigenshape.geometry.topology import boundary_vertices
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.graph import edge_graph

# Steps of Taubin's filter, without unit: λ and μ of his paper's examples (0.33, -0.34) are weaker;
# these give the pass band 1/λ + 1/μ = 0.1 that he recommends, with λ = 0.5.
SHRINK, INFLATE = 0.5, -1 / 1.9
# A mode inside the pass band grows a little in each step of Taubin's filter, by 1.0007 with these
# weights: beyond this the shape is distorted more than noise would do.
LARGEST_GROWTH = 2.0
# A surface of less than this share of its first size counts as a point: with implicit steps it
# shrinks on and on without ever becoming one.
COLLAPSED = 1e-6


def mean_curvature_flow(
    mesh: MeshLike,
    t: float,
    *,
    n_steps: Integer = 10,
    conformal: bool = False,
    fixed: ArrayLike | None = None,
    progress: Progress | None = None,
) -> TriangleMesh:
    """Move a surface along its normals at the speed of its mean curvature, by implicit steps.

    ∂x/∂t = -L x = -2 H N. Each step of length τ = t / n_steps solves (B + τW) x' = B x (Desbrun,
    Meyer, Schröder and Barr 1999), with W and B of the current surface. A sphere of radius R
    shrinks to radius √(R² - 4t). Necks pinch off in finite time; the conformal flow keeps the W of
    the first surface, has no such singularities in practice, and takes a surface of genus 0 towards
    a sphere (Kazhdan, Solomon and Ben-Chen 2012).

    Parameters
    ----------
    mesh : MeshLike
        A surface, with or without boundary.
    t : float
        Time, in length².
    n_steps : int
        More steps follow the flow more closely; any number is stable.
    conformal : bool
        Whether W stays that of the first surface.
    fixed : (c,) int, optional
        Vertices that stay where they are; by default those on the boundary, so that the surface
        goes towards a minimal surface. `fixed=[]` fixes none.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    TriangleMesh
        With the same faces.

    Raises
    ------
    InvalidParameterError
        If t is not positive, n_steps is not in 1..1,000,000, or a fixed vertex is out of range.
    InvalidShapeError
        If a face has no area or occurs twice, or a vertex has no face; or if the surface has
        collapsed at some step.

    See Also
    --------
    es.operators.denoise : One step that depends on the noise, without shrinking.
    es.calculus.taubin_smooth : Smoothing without shrinking.

    Examples
    --------
    >>> import eigenshape as es
    >>> import numpy as np
    >>> ball = es.calculus.mean_curvature_flow(es.icosphere(3), 0.1, n_steps=50)
    >>> radius = np.linalg.norm(ball.vertices, axis=1).mean()
    >>> bool(abs(radius - 0.6**0.5) < 0.002)
    True
    """
    mesh = as_mesh(mesh)
    time = positive_number(t, "t")
    count = step_number(n_steps)
    points, scale = size_one(mesh.vertices)
    step = time / count / scale / scale
    held = require_points(boundary_vertices(mesh) if fixed is None else fixed, mesh.n_vertices)
    held = np.unique(held)
    first = cotangent_laplacian(TriangleMesh(points, mesh.faces))
    size = np.ptp(points, axis=0).max()
    report_progress = progress or silent
    for number in range(count):
        report_progress(number / count, f"step {number + 1} of {count}")
        if np.ptp(points, axis=0).max() < COLLAPSED * size:
            raise InvalidShapeError(
                "The flow must stop before the surface collapses; after step "
                f"{number} of {count} it is a point. Pass a smaller t."
            )
        try:
            operator = cotangent_laplacian(TriangleMesh(points, mesh.faces)) if number else first
            stiffness = first.stiffness if conformal else operator.stiffness
            solver = factor_definite(operator.mass + step * stiffness, held)
        except (InvalidShapeError, InvalidParameterError) as err:
            raise InvalidShapeError(
                f"The flow must stop before faces collapse; after step {number} of {count} one "
                "has no area, up to rounding. Pass a smaller t, or conformal=True."
            ) from err
        points = solver.solve(operator.mass @ points, values=points[held] if len(held) else 0.0)
    return TriangleMesh(points * scale, mesh.faces)


def taubin_smooth(
    mesh: MeshLike,
    n_steps: Integer = 10,
    *,
    shrink: float = SHRINK,
    inflate: float = INFLATE,
    fixed: ArrayLike | None = None,
) -> Mesh:
    """Smooth a mesh without shrinking it, by Taubin's alternating filter (1995).

    With K = I - D⁻¹A of the edge graph, each step is x ← (I - μK)(I - λK) x: the first factor
    smooths and shrinks, the second inflates. A mode of eigenvalue k of K, in 0..2, is multiplied by
    (1 - λk)(1 - μk); those below the pass band 1/λ + 1/μ keep their size. The filter acts on the
    graph, so it also evens out the edges; `mean_curvature_flow` and `denoise` depend on the
    geometry only.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension.
    n_steps : int
    shrink : float
        λ, in 0..1.
    inflate : float
        μ, below -λ.
    fixed : (c,) int, optional
        Points that stay where they are: `boundary_vertices(mesh)` smooths the inside only.

    Returns
    -------
    TriangleMesh or SimplicialMesh
        Of the type of the mesh, with the same simplices.

    Raises
    ------
    InvalidParameterError
        If n_steps is not in 1..1,000,000, λ is not in 0..1, μ is not below -λ, a mode would grow more
        than 2 times in all steps, or a fixed point is out of range.

    See Also
    --------
    es.operators.denoise : Depends on the noise of the mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> import numpy as np
    >>> ball = es.icosphere(3)
    >>> noise = 0.02 * np.random.default_rng(0).standard_normal(ball.vertices.shape)
    >>> noisy = es.TriangleMesh(ball.vertices + noise, ball.faces)
    >>> smooth = es.calculus.taubin_smooth(noisy)
    >>> es.operators.noise_level(smooth) < 0.8 * es.operators.noise_level(noisy)
    True
    """
    mesh = as_simplicial(mesh)
    count = step_number(n_steps)
    weight = finite_number(shrink, "shrink")
    back = finite_number(inflate, "inflate")
    if not 0 < weight <= 1 or not back < -weight:
        raise InvalidParameterError(
            f"shrink must lie in 0..1 and inflate below -shrink; they are {weight} and {back}."
        )
    # Largest size of (1 - λk)(1 - μk): at its vertex, or at the highest mode k = 2.
    vertex = (weight + back) / (2 * weight * back)
    gain = max(abs((1 - weight * k) * (1 - back * k)) for k in (min(vertex, 2.0), 2.0))
    if count * np.log(gain) > np.log(LARGEST_GROWTH):
        most = int(np.log(LARGEST_GROWTH) / np.log(gain))
        raise InvalidParameterError(
            f"No mode may grow more than {LARGEST_GROWTH:g} times; in each step one grows {gain:.6g} "
            f"times, so n_steps can be at most {most}; it is {count}. Take fewer steps, or inflate "
            "nearer to -shrink."
        )
    moving = np.ones(mesh.n_points, dtype=bool)
    moving[require_points([] if fixed is None else fixed, mesh.n_points)] = False
    links = edge_graph(mesh)
    degrees = links.sum(axis=1)
    moving &= degrees > 0  # a point without simplices stays
    mean = sp.diags_array(1 / np.maximum(degrees, 1)) @ links
    points = mesh.points.copy()
    for _ in range(count):
        for factor in (weight, back):
            step = factor * (mean @ points - points)
            points[moving] += step[moving]
    return type(mesh)(points, mesh.simplices)
