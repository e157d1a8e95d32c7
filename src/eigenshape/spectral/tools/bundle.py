"""Operators for learning: what DiffusionNet and its relatives take of a shape, computed once."""

import hashlib
import warnings
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from certeig.kit.archive import (
    open_archive,
    require_finite_floats,
    take_arrays,
    write_arrays,
)
from certeig.kit.arguments import describe_value, require_choice, require_each, require_type
from certeig.kit.arrays import ReadOnly, record, whole_number
from certeig.kit.errors import FileFormatError, InvalidParameterError
from certeig.kit.files import as_path, require_writable
from certeig.kit.matrices import freeze_sparse
from certeig.kit.progress import Callback, Progress
from certeig.kit.typing import Integer
from eigenshape._errors import InvalidShapeError
from eigenshape._extras import import_extra
from eigenshape._workers import Item, Workers, run_in_workers
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import ShapeLike, as_mesh, as_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.operators.catalog import build_laplacian
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.tools.vertex_gradient import (
    Shape3,
    fit_gradient,
    neighbor_edges,
    point_frames,
)

Form = Literal["scipy", "numpy", "torch"]
Precision = Literal["single", "double"]
Read = Callable[[Path], ShapeLike]
# Version of the file format; a file of another version is refused.
FORMAT = 1
# What a file holds as arrays, and what as sparse matrices.
DENSE = ("frames", "mass", "eigenvalues", "eigenvectors")
SPARSE = ("stiffness", "gradient_x", "gradient_y")


@record
class OperatorBundle(ReadOnly):
    """The operators of one shape that networks on surfaces take, such as DiffusionNet.

    In the order of the function `get_operators` of DiffusionNet: frames, mass vector, L, evals,
    evecs, gradX, gradY.

    Attributes
    ----------
    frames : (n, 3, 3) float
        Two tangents and the normal of each point, in rows: a right-handed orthonormal frame.
    mass : (n,) float
        Diagonal of B, in length².
    stiffness : (n, n) sparse
        W, the weak Laplacian, positive semidefinite.
    eigenvalues : (k,) float
        In 1/length².
    eigenvectors : (n, k) float
        Columns with ΦᵀBΦ = I.
    gradient_x, gradient_y : (n, n) sparse
        Components of the gradient of a function along the two tangents, in 1/length.

    See Also
    --------
    operator_bundle, export_bundle

    Examples
    --------
    Diffuse a function on the vertices for the time t, as a layer of DiffusionNet does:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> bundle = es.spectral.operator_bundle(ball, 16)
    >>> height, t = ball.vertices[:, 2], 0.1
    >>> coefficients = bundle.eigenvectors.T @ (bundle.mass * height)
    >>> diffused = bundle.eigenvectors @ (np.exp(-t * bundle.eigenvalues) * coefficients)
    >>> round(float(diffused.max() / height.max()), 2)  # exp(-2 t): the height has λ = 2
    0.82
    """

    frames: Float[np.ndarray, "n 3 3"]
    mass: Float[np.ndarray, " n"]
    stiffness: sp.csr_array
    eigenvalues: Float[np.ndarray, " k"]
    eigenvectors: Float[np.ndarray, "n k"]
    gradient_x: sp.csr_array
    gradient_y: sp.csr_array


def operator_bundle(
    shape: ShapeLike,
    k: Integer = 128,
    *,
    operator: str | None = None,
    cache: str | Path | None = None,
    progress: Progress | None = None,
) -> OperatorBundle:
    """Compute the operators that DiffusionNet takes of a mesh or a point cloud.

    The gradient at a point is the linear function on its tangent plane that fits the differences to
    its neighbors best (Sharp, Attaiki, Crane and Ovsjanikov 2022, section 3.5): on a mesh the ends
    of its edges, on a cloud the 30 nearest points. DiffusionNet adds 1e-5 to the normal equations;
    this function adds nothing, so the gradient of a linear function on a plane is exact and scales
    with units.

    Parameters
    ----------
    shape : ShapeLike
        A triangle mesh, or a point cloud of a surface in R³.
    k : int
        Number of eigenpairs, 1 to n.
    operator : str, optional
        A name in `es.operators.OPERATORS` whose mass is diagonal. By default "cotangent" for meshes
        and "robust" for clouds, as DiffusionNet takes them.
    cache : path, optional
        Folder in which bundles are kept, each under a hash of the shape and the request. A bundle
        found there is loaded instead of computed.
    progress : callable, optional
        Called as progress(fraction_done, message) while eigenpairs are computed.

    Returns
    -------
    OperatorBundle

    Raises
    ------
    InvalidShapeError
        If the shape is not a surface in R³, the operator cannot be built on it, or a cloud has less
        than three points.
    InvalidParameterError
        If `k` is not in 1..n, there is no such operator, it has unknowns other than the points or a
        mass that is not diagonal, or the folder `cache` cannot be written to.

    Warns
    -----
    UserWarning
        If a file in `cache` is damaged and the bundle is computed again.

    See Also
    --------
    export_bundle : Convert a bundle to plain arrays or to torch tensors.
    cache_operator_bundles : Compute the bundles of many files in several processes.

    Examples
    --------
    The gradient of the height on a plane square points along one axis and has length 1:

    >>> import eigenshape as es
    >>> square = es.shapes.grid(4, 4)
    >>> bundle = es.spectral.operator_bundle(square, 8)
    >>> height = square.vertices[:, 0]
    >>> squared = (bundle.gradient_x @ height) ** 2 + (bundle.gradient_y @ height) ** 2
    >>> bool(abs(squared - 1).max() < 1e-12)
    True
    """
    surface = _require_surface(as_shape(shape))
    count = whole_number(k, "k", 1, surface.n_points)
    name = operator or ("robust" if isinstance(surface, PointCloud) else "cotangent")
    if cache is not None:
        path = as_path(cache, "cache") / f"{_content_key(surface, count, name)}.npz"
        if path.exists():
            try:
                return OperatorBundle(**_read_bundle(path))
            except FileFormatError as error:
                warnings.warn(
                    f"A bundle in the cache cannot be used and is computed again: {error}",
                    stacklevel=2,
                )
        require_writable(cache)  # before the work, not after it

    laplacian = build_laplacian(surface, name)
    mass = laplacian.mass.diagonal()
    if laplacian.n_points != surface.n_points or laplacian.mass.count_nonzero() != len(mass):
        raise InvalidParameterError(
            "The operator of a bundle must have one unknown for each point and a diagonal mass; "
            f"this one has {laplacian.n_points} unknowns on {surface.n_points} points. "
            "Leave out operator, or pass 'robust'."
        )
    edges = neighbor_edges(surface)
    frames = point_frames(surface, edges)
    gradient_x, gradient_y = fit_gradient(surface.points, frames, edges)
    spectrum = solve_spectrum(laplacian, count, progress=progress)
    bundle = OperatorBundle(
        frames=frames,
        mass=mass,
        stiffness=freeze_sparse(laplacian.stiffness),
        eigenvalues=spectrum.eigenvalues,
        eigenvectors=spectrum.eigenvectors,
        gradient_x=freeze_sparse(gradient_x),
        gradient_y=freeze_sparse(gradient_y),
    )
    if cache is not None:
        try:
            fields = {name: getattr(bundle, name) for name in (*DENSE, *SPARSE)}
            write_arrays(path, {"eigenshape_bundle": FORMAT}, fields)
        except OSError as error:
            warnings.warn(
                f"A bundle was computed and could not be kept in the cache: {error}", stacklevel=2
            )
    return bundle


def export_bundle(
    bundle: OperatorBundle, form: Form = "torch", precision: Precision = "single"
) -> tuple[Any, ...]:
    """Convert a bundle to plain arrays or tensors, in the order of DiffusionNet.

    Parameters
    ----------
    bundle : OperatorBundle
    form : {"torch", "scipy", "numpy"}
        Sparse matrices become sparse COO tensors of torch, csr_array of SciPy, or pairs
        (indices (2, e), values (e,)) of NumPy, which other frameworks take.
    precision : {"single", "double"}
        Of the real numbers; indices are int64.

    Returns
    -------
    tuple
        frames (n, 3, 3), mass (n,), L (n, n), eigenvalues (k,), eigenvectors (n, k), gradX (n, n)
        and gradY (n, n).

    Raises
    ------
    InvalidParameterError
        If the form or the precision is not one of those.
    MissingExtraError
        If torch is requested and not installed. It is not a dependency of eigenshape.

    Examples
    --------
    >>> import eigenshape as es
    >>> bundle = es.spectral.operator_bundle(es.icosphere(1), 6)
    >>> frames, mass, L, values, vectors, grad_x, grad_y = es.spectral.export_bundle(
    ...     bundle, "scipy"
    ... )
    >>> L.shape, str(L.dtype), vectors.shape
    ((42, 42), 'float32', (42, 6))
    """
    require_type(bundle, OperatorBundle, "bundle")
    require_choice(form, Form, "form")
    require_choice(precision, Precision, "precision")
    dtype = np.float32 if precision == "single" else np.float64
    # The attributes of a bundle stand in the order of DiffusionNet.
    return tuple(_convert(part.astype(dtype), form) for part in vars(bundle).values())


def cache_operator_bundles(  # noqa: PLR0913 - one keyword for each choice of a batch
    items: Sequence[Item],
    read: Read,
    cache: str | Path,
    k: Integer = 128,
    *,
    operator: str | None = None,
    workers: Workers = Workers(),
    callback: Callback | None = None,
) -> tuple[tuple[str, str], ...]:
    """Compute the bundles of many files in several processes, and keep them in a folder.

    After that, `operator_bundle` with the same `cache`, `k` and `operator` loads the bundle of each
    shape. A file that raises an error, hangs or kills its process is reported, and the others go
    on. After Ctrl-C the same call computes what is missing.

    Parameters
    ----------
    items : sequence of Item
        Files with the names of their shapes.
    read : callable
        Return the shape of a path: ``es.read_mesh``, or a function of yours that a new process can
        import by name.
    cache : path
        Folder for the bundles.
    k, operator
        As of `operator_bundle`.
    workers : Workers
    callback : callable, optional
        Called as callback(n_done, n_items, name, error or None) after each file.

    Returns
    -------
    tuple of (str, str)
        Name and reason of each file that failed, in the order of `items`.

    Raises
    ------
    InvalidParameterError
        If `k` is less than 1, or the folder cannot be written to.
    EigenshapeError
        If no worker can start. A script must call this under ``if __name__ == "__main__":``, since
        workers import the script.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> import eigenshape as es
    >>> es.spectral.cache_operator_bundles([], es.read_mesh, mkdtemp())  # with items: main guard
    ()
    """
    require_each(items, Item, "items")
    require_type(workers, Workers, "workers")
    count = whole_number(k, "k", 1)
    require_writable(cache)
    work = partial(_keep_bundle_of, read, Path(cache).absolute(), count, operator)
    failed: dict[int, tuple[str, str]] = {}
    places = {id(item): place for place, item in enumerate(items)}
    if not items:
        return ()
    with closing(run_in_workers(work, items, workers)) as outcomes:
        for n_done, (item, outcome) in enumerate(outcomes, start=1):
            if outcome.error is not None:
                failed[places[id(item)]] = (item.name, outcome.error)
            if callback is not None:
                callback(n_done, len(items), item.name, outcome.error)
    return tuple(failed[place] for place in sorted(failed))


def _keep_bundle_of(read: Read, cache: Path, k: int, operator: str | None, path: Path) -> None:
    """Compute and keep the bundle of a file, in a worker."""
    operator_bundle(read(path), k, operator=operator, cache=cache)


def _require_surface(shape: Any) -> Shape3:
    """Return the shape if it is a triangle mesh or a cloud of a surface in R³."""
    if isinstance(shape, SimplicialMesh) and (shape.dim, shape.points.shape[1]) == (2, 3):
        return as_mesh(shape)
    is_cloud = isinstance(shape, PointCloud)
    if not isinstance(shape, TriangleMesh) and not (is_cloud and shape.points.shape[1] == 3):
        raise InvalidShapeError(
            "A bundle takes a triangle mesh or points in R³, because its gradients lie in tangent "
            f"planes; the shape is {describe_value(shape)} in R^{shape.points.shape[1]}."
        )
    if is_cloud and (shape.dim != 2 or shape.n_points < 3):
        raise InvalidShapeError(
            "A cloud must have dim=2 and at least 3 points for tangent planes; it has "
            f"dim={shape.dim} and {shape.n_points} points."
        )
    return shape


def _content_key(shape: Shape3, k: int, operator: str) -> str:
    """Return the SHA-256 of the coordinates, the faces, the request and our version."""
    request = (FORMAT, version("eigenshape"), type(shape).__name__, k, operator)
    digest = hashlib.sha256(repr(request).encode())
    for array in (shape.points, getattr(shape, "faces", np.empty((0, 3), dtype=np.int64))):
        digest.update(repr(array.shape).encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def _convert(part: Any, form: Form) -> Any:
    """Return an array or a sparse matrix as it is, as arrays, or as a tensor."""
    is_sparse = sp.issparse(part)
    if form == "scipy" or (form == "numpy" and not is_sparse):
        return part
    if is_sparse:
        entries = part.tocoo()
        indices, values = np.stack([entries.row, entries.col]).astype(np.int64), entries.data
    if form == "numpy":
        return indices, values
    torch = import_extra("torch", "torch, or pass form='numpy'")
    if not is_sparse:
        return torch.from_numpy(part)
    # torch 2.13 warns if nothing is said about the checks; they cost less than the conversion.
    tensor = torch.sparse_coo_tensor(
        torch.from_numpy(indices), torch.from_numpy(values), part.shape, check_invariants=True
    )
    return tensor.coalesce()


def _read_bundle(path: Path) -> dict[str, Any]:
    """Read the arrays of a bundle.

    Raise FileFormatError if the file is not a bundle, is damaged or of another version, or its
    arrays do not fit together or are not finite.
    """
    with open_archive(path, "bundle", FORMAT, "eigenshape") as (_, archive):
        n, k = len(archive["mass"]), archive["eigenvalues"].size
        fields = take_arrays(archive, DENSE, SPARSE, n)
    shapes = {"frames": (n, 3, 3), "mass": (n,), "eigenvalues": (k,), "eigenvectors": (n, k)}
    for name, shape in shapes.items():
        if fields[name].shape != shape:
            raise FileFormatError(
                f"{path} must hold arrays that fit together; {name} has shape {fields[name].shape} for "
                f"{n} points and {k} eigenvalues."
            )
    require_finite_floats(path, fields)
    return fields
