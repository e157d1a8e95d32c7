"""Figures of functions and parts on a shape."""

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int, UInt8
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from certeig.kit.arguments import require_type
from certeig.kit.arrays import finite_values, real_numbers, whole_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import face_labels, vertex_values
from eigenshape._errors import count_nouns
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.plot.camera import Camera, Up, View, choose_camera
from eigenshape.plot.figure import Figure
from eigenshape.plot.render import Drawing, draw, palette
from eigenshape.spectral.spectrum import Spectrum

PANEL = 3.2  # inches; width of one drawing
NO_VALUE = "0.72"  # gray of vertices without a value, as of faces without a part
DOT = 46.0  # square points; area of the mark of a vertex


def figure_eigenfunctions(
    mesh: MeshLike,
    spectrum: Spectrum,
    indices: ArrayLike,
    *,
    camera: Camera | None = None,
    view: View = "auto",
    up: Up = "auto",
) -> Figure:
    """Draw eigenfunctions side by side, with their nodal lines.

    Each is divided by its largest absolute value. Dark lines mark where it is zero.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices.
    spectrum : Spectrum
        Of an operator on the n vertices.
    indices : (c,) int
        Which columns of `spectrum.eigenvectors` to draw, 0 to k - 1, four in a row.
    camera : Camera, optional
        Instead of `view` and `up`.
    view : str or (3,) float
        The side from which the shape is drawn, as in `aim_camera`.
    up : str or (3,) float
        The upward direction, as in `aim_camera`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If the spectrum is of another number of points, or a column is out of range or none is
        given.

    See Also
    --------
    figure_field : Draw one function, with a color bar.
    figure_spectrum : Plot the eigenvalues.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), k=4)
    >>> figure = es.plot.figure_eigenfunctions(mesh, spectrum, [1, 2, 3])
    >>> len(figure.axes)  # three drawings and a color bar
    4
    """
    mesh = as_mesh(mesh)
    require_type(spectrum, Spectrum, "spectrum")
    n_points, n_pairs = spectrum.eigenvectors.shape
    if n_points != mesh.n_vertices:
        raise InvalidParameterError(
            f"spectrum must be of the mesh, which has {mesh.n_vertices} vertices; "
            f"its eigenvectors have {n_points} entries."
        )
    chosen = whole_numbers(indices, "An index", 0, n_pairs - 1).tolist()
    if not chosen:
        raise InvalidParameterError("indices must name at least one eigenfunction; it is empty.")
    camera = choose_camera(mesh, camera, view, up, size=420)
    figure, grid = empty_grid(len(chosen), min(len(chosen), 4))
    scale = ScalarMappable(Normalize(-1, 1), "RdBu_r")
    for axes, index in zip(grid.flat, chosen, strict=False):
        function = spectrum.eigenvectors[:, index]
        shown = function / np.abs(function).max()
        # A constant function is zero nowhere, whatever its rounding.
        zero_set_of = shown if np.ptp(shown) > 1e-6 else np.ones_like(shown)
        shades = map_colors(shown, scale)
        show(axes, draw(mesh, camera, vertex_colors=shades, zero_set_of=zero_set_of))
        number = spectrum.certificate.first + index
        axes.set_title(f"φ$_{{{number}}}$,  λ = {spectrum.eigenvalues[index]:.4g}")
    label = "eigenfunction / its largest value (dark line: 0)"
    figure.colorbar(scale, ax=grid, shrink=0.7, label=label)
    return figure


def figure_field(  # noqa: PLR0913 - what is drawn, and one keyword for each choice of how
    mesh: MeshLike,
    values: ArrayLike,
    label: str = "",
    *,
    camera: Camera | None = None,
    view: View = "auto",
    up: Up = "auto",
    color_map: str = "viridis",
    limits: tuple[float, float] | None = None,
) -> Figure:
    """Draw one function on a mesh, with a color bar.

    Vertices without a value are gray, and the color bar says so.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices.
    values : (n,) float
        The function, one value for each vertex; NaN where there is none.
    label : str
        Text beside the color bar, such as the name of the function and its unit.
    camera : Camera, optional
        Instead of `view` and `up`.
    view : str or (3,) float
        The side from which the shape is drawn, as in `aim_camera`.
    up : str or (3,) float
        The upward direction, as in `aim_camera`.
    color_map : str
        Name of a color map of matplotlib.
    limits : (float, float), optional
        Values at the ends of the color bar, so that several pictures have the same colors; values
        beyond them have the colors of the ends. The default is the lowest and the highest value.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If `values` does not hold one number per vertex, one is infinite or all are NaN, `limits` is
        not two ascending numbers, or the view is not valid.

    See Also
    --------
    figure_segments : Draw the parts of a mesh.
    save_figure : Write a figure to a file.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> figure = es.figure_field(mesh, mesh.vertices[:, 2], "height, length")
    >>> figure.axes[-1].get_ylabel()
    'height, length'
    """
    mesh = as_mesh(mesh)
    figure = Figure(2 * PANEL + 1.2, 2 * PANEL)
    axes = figure.subplots()
    field = vertex_field(values, mesh)
    scale, extend = value_scale(field, limits, color_map)
    camera = choose_camera(mesh, camera, view, up)
    show(axes, draw(mesh, camera, vertex_colors=map_colors(field, scale)))
    text = bar_label(label, field)
    figure.colorbar(scale, ax=axes, shrink=0.8, extend=extend, label=text)
    return figure


def figure_fields(  # noqa: PLR0913 - what is drawn, and one keyword for each choice of how
    fields: Mapping[str, tuple[MeshLike, ArrayLike]],
    label: str = "",
    *,
    camera: Camera | None = None,
    view: View = "auto",
    up: Up = "auto",
    color_map: str = "viridis",
    limits: tuple[float, float] | None = None,
) -> Figure:
    """Draw functions on one or several meshes side by side, with one color bar.

    Parameters
    ----------
    fields : mapping of titles to (MeshLike, (n,) float)
        For each drawing a mesh and one value for each of its n vertices, NaN where there is none.
    label : str
        Text beside the color bar, such as the name of the function and its unit.
    camera : Camera, optional
        Of all drawings, instead of `view` and `up`. Each mesh fills its picture.
    view : str or (3,) float
        The side from which each mesh is drawn, as in `aim_camera`.
    up : str or (3,) float
        The upward direction, as in `aim_camera`.
    color_map : str
        Name of a color map of matplotlib.
    limits : (float, float), optional
        Values at the ends of the color bar. The default is the lowest and the highest value of all.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If there is no field, one is not a mesh and its values, or values, `limits` or the view are
        not valid for `figure_field`.

    See Also
    --------
    figure_field : Draw one function, larger.
    figure_eigenfunctions : Draw eigenfunctions with their nodal lines.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> x, y, _ = ball.vertices.T
    >>> figure = es.plot.figure_fields({"x": (ball, x), "y": (ball, y)}, "coordinate, length")
    >>> [axes.get_title() for axes in figure.axes[:2]]
    ['x', 'y']
    """
    require_type(fields, Mapping, "fields")
    if not fields:
        raise InvalidParameterError("fields must hold at least one field; it is empty.")
    shapes = {}
    for title, pair in fields.items():
        if not isinstance(pair, tuple) or len(pair) != 2:
            raise InvalidParameterError(
                f"fields must hold pairs (mesh, values); {title!r} has a {type(pair).__name__}."
            )
        mesh = as_mesh(pair[0], title)
        shapes[title] = (mesh, vertex_field(pair[1], mesh))
    everything = np.ma.concatenate([field for _, field in shapes.values()])
    scale, extend = value_scale(everything, limits, color_map)
    n_columns = 2 if len(shapes) == 4 else min(len(shapes), 3)
    figure, grid = empty_grid(len(shapes), n_columns)
    for axes, (title, (mesh, field)) in zip(grid.flat, shapes.items(), strict=False):
        aimed = choose_camera(mesh, camera, view, up, size=420)
        show(axes, draw(mesh, aimed, vertex_colors=map_colors(field, scale)))
        axes.set_title(title)
    text = bar_label(label, everything)
    figure.colorbar(scale, ax=grid, shrink=0.7, extend=extend, label=text)
    return figure


def empty_grid(n_drawings: int, n_columns: int, size: float = PANEL) -> tuple[Figure, np.ndarray]:
    """Return a figure with room for a color bar, and its axes, without frames: some rows of drawings."""
    n_rows = -(-n_drawings // n_columns)
    figure = Figure(size * n_columns + 0.8, (size + 0.3) * n_rows)
    grid = figure.subplots(n_rows, n_columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    return figure, grid


def two_panels() -> tuple[Figure, Axes, Axes]:
    """Return a figure of two large drawings side by side, and its axes."""
    figure = Figure(4.4 * PANEL, 2.2 * PANEL + 0.4)
    left, right = figure.subplots(1, 2)
    return figure, left, right


def vertex_field(values: ArrayLike, mesh: TriangleMesh) -> np.ma.MaskedArray:
    """Return one number per vertex, masked where it is NaN.

    Raise InvalidParameterError if there is another number of values, or one is infinite.
    """
    field = real_numbers(values, "values").astype(np.float64)
    if field.shape == (mesh.n_faces,) != (mesh.n_vertices,):
        raise InvalidParameterError(
            f"values must hold one number per vertex, shape ({mesh.n_vertices},); there is one for each "
            f"of {mesh.n_faces} faces. es.figure_segments draws labels of faces; values of faces become "
            "those of vertices by es.calculus.average_onto_points."
        )
    missing = np.isnan(field)
    vertex_values(np.where(missing, 0.0, field), "values", mesh.n_vertices)
    return np.ma.masked_array(field, missing)


def value_scale(
    field: np.ma.MaskedArray, limits: tuple[float, float] | None, color_map: str
) -> tuple[ScalarMappable, str]:
    """Return the scale of the colors of a field, and at which ends it has values beyond that.

    Raise InvalidParameterError if there is no value, or `limits` are not two ascending numbers.
    """
    known = field.compressed()
    if not known.size:
        raise InvalidParameterError("values must hold a number; all are NaN.")
    extremes = [known.min(), known.max()]
    ends = finite_values(extremes if limits is None else np.asarray(limits), "limits")
    if len(ends) != 2 or ends[0] > ends[1]:
        raise InvalidParameterError(
            f"limits must be two numbers, the lower one first; they are {ends.tolist()}."
        )
    below, above = bool((known < ends[0]).any()), bool((known > ends[1]).any())
    extend = {(1, 1): "both", (1, 0): "min", (0, 1): "max", (0, 0): "neither"}[below, above]
    colors = mpl.colormaps[color_map].with_extremes(bad=NO_VALUE)
    return ScalarMappable(Normalize(*ends), colors), extend


def bar_label(label: str, field: np.ma.MaskedArray) -> str:
    """Return the text beside a color bar, which says what gray means where there is any."""
    return f"{label} (gray: no value)".strip() if np.ma.is_masked(field) else label


def map_colors(values: Float[np.ndarray, " n"], scale: ScalarMappable) -> Float[np.ndarray, "n 3"]:
    """Return the color of each value."""
    return scale.to_rgba(values)[:, :3]


def figure_segments(
    mesh: MeshLike,
    labels: ArrayLike,
    vertices: ArrayLike | None = None,
    *,
    camera: Camera | None = None,
    view: View = "auto",
    up: Up = "auto",
) -> Figure:
    """Draw the parts of a mesh in colors, with their numbered feature points.

    Feature points on the far side of the mesh are hollow and have no number.

    Parameters
    ----------
    mesh : MeshLike
        With f faces.
    labels : (f,) int
        Number of the part of each face. Faces below 0 are gray.
    vertices : (m,) int, optional
        Feature point of each part. By default none is drawn.
    camera : Camera, optional
        Instead of `view` and `up`.
    view : str or (3,) float
        The side from which the shape is drawn, as in `aim_camera`.
    up : str or (3,) float
        The upward direction, as in `aim_camera`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If `labels` does not hold one whole number per face, or a feature point is not a vertex.

    See Also
    --------
    part_colors : Colors of the same parts for a mesh file.
    find_parts, segment : Compute parts.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> upper = mesh.vertices[mesh.faces].mean(axis=1)[:, 1] > 0
    >>> poles = mesh.vertices[:, 1].argsort()[[0, -1]]
    >>> figure = es.figure_segments(mesh, upper.astype(int), poles)
    >>> figure.axes[0].get_title()
    '2 parts around their feature points (hollow: on the far side)'
    """
    mesh = as_mesh(mesh)
    labels = face_labels(labels, "labels", mesh)
    marked = np.empty(0, dtype=np.int64)
    if vertices is not None:
        marked = whole_numbers(vertices, "A feature point", 0, mesh.n_vertices - 1)
    figure = Figure(2 * PANEL, 2 * PANEL + 0.4)
    axes = figure.subplots()
    drawing = draw(mesh, choose_camera(mesh, camera, view, up), face_colors=palette(labels))
    show(axes, drawing)
    mark(axes, drawing, marked, numbers=True)
    if len(marked):
        points = "its feature point" if len(marked) == 1 else "their feature points"
        title = f"{count_nouns(len(marked), 'part')} around {points} (hollow: on the far side)"
    else:
        title = count_nouns(len(np.unique(labels[labels >= 0])), "part")
    axes.set_title(title, fontsize=10)
    return figure


def part_colors(mesh: MeshLike, labels: ArrayLike) -> UInt8[np.ndarray, "n 3"]:
    """Return a color for each vertex, by the part that has most of the area around it.

    Parts have the same colors as in `figure_segments`. Faces without a part, below 0, are gray.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices and f faces.
    labels : (f,) int
        Number of the part of each face.

    Returns
    -------
    (n, 3) uint8
        Red, green and blue, for `write_mesh`.

    Raises
    ------
    InvalidParameterError
        If `labels` does not hold one whole number per face.

    See Also
    --------
    value_colors : Color vertices by a function.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> upper = mesh.vertices[mesh.faces].mean(axis=1)[:, 1] > 0
    >>> colors = es.plot.part_colors(mesh, upper.astype(int))
    >>> colors.shape, len(set(map(tuple, colors.tolist())))
    ((42, 3), 2)
    """
    mesh = as_mesh(mesh)
    labels = face_labels(labels, "labels", mesh).astype(np.int64)
    corners, areas = mesh.faces.ravel(), np.repeat(face_areas(mesh), 3)
    shape = (mesh.n_vertices, int(labels.max(initial=-1)) + 2)
    around = sp.csr_array(
        (areas / (areas.max() or 1.0), (corners, np.repeat(labels, 3) + 1)), shape=shape
    )
    return _bytes(palette(np.asarray(around.argmax(axis=1)).ravel() - 1))


def value_colors(values: ArrayLike, color_map: str = "viridis") -> UInt8[np.ndarray, "n 3"]:
    """Return a color for each vertex, by the value of a function.

    Parameters
    ----------
    values : (n,) float
        One for each vertex. The lowest and the highest value have the ends of the color map.
    color_map : str
        Name of a color map of matplotlib.

    Returns
    -------
    (n, 3) uint8
        Red, green and blue, for `write_mesh`.

    Raises
    ------
    InvalidParameterError
        If `values` is not a list of finite numbers.

    See Also
    --------
    part_colors : Color vertices by parts.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.plot.value_colors([0.0, 1.0, 2.0], "gray").tolist()
    [[0, 0, 0], [128, 128, 128], [255, 255, 255]]
    """
    field = finite_values(values, "values")
    scale = Normalize(float(field.min()), float(field.max()))
    return _bytes(map_colors(field, ScalarMappable(scale, mpl.colormaps[color_map])))


def _bytes(colors: Float[np.ndarray, "n 3"]) -> UInt8[np.ndarray, "n 3"]:
    return np.round(255 * colors).astype(np.uint8)


def show(axes: Axes, drawing: Drawing) -> None:
    """Put a drawing into axes without ticks or frame."""
    axes.imshow(drawing.image, interpolation="antialiased")
    axes.set_axis_off()


def mark(
    axes: Axes, drawing: Drawing, vertices: Int[np.ndarray, " m"], *, numbers: bool = False
) -> None:
    """Mark vertices by red dots, hollow where the shape hides them."""
    for number, vertex in enumerate(vertices.tolist()):
        x, y = drawing.places[vertex]
        seen = bool(drawing.visible[vertex])
        face, rim = ("#d62728", "black") if seen else ("none", "#7f7f7f")
        axes.scatter([x], [y], s=DOT, c=face, edgecolors=rim, linewidths=1.0, zorder=3)
        if numbers and seen:
            axes.annotate(
                str(number), (x, y), (5, 5), textcoords="offset points", fontsize=8, zorder=4
            )
