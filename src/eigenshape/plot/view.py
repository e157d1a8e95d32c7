"""The studio in a notebook."""

from collections.abc import Mapping
from typing import Any

from certeig.kit.typing import ArrayLike
from eigenshape._extras import import_extra
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.plot.camera import Up, View, is_auto


def view(
    mesh: MeshLike,
    values: Mapping[str, ArrayLike] | ArrayLike | None = None,
    *,
    height: int = 640,
    view: View = "auto",
    up: Up = "auto",
) -> Any:
    """Show a shape in a notebook, where it can be turned, bent and examined.

    This is the studio as a widget for JupyterLab, VS Code and marimo. It has the panels of
    `eigenshape studio`: deformation, repairs, spectrum, heat and parts. `widget.mesh` is the shape
    in its present pose.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices.
    values : (n,) float, or {title: (n,) float}, optional
        Functions on the vertices to choose from. A title can end with a unit in parentheses.
    height : int
        Height of the widget in pixels.
    view : str or (3,) float
        The side from which the shape is shown at first, as in `aim_camera`.
    up : str or (3,) float
        The upward direction, as in `aim_camera`.

    Returns
    -------
    ShapeWidget
        A widget of anywidget; the last line of a cell shows it.

    Raises
    ------
    InvalidParameterError
        If a function does not have one finite value per vertex, or the view is not valid.
    MissingExtraError
        If the package eigenshape-studio or anywidget is not installed.

    See Also
    --------
    figure_field : Draw a function as a picture.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> values = {"height (m)": mesh.vertices[:, 2]}
    >>> widget = es.view(mesh, values)  # doctest: +SKIP
    """
    surface = as_mesh(mesh)
    if values is None:
        values = {}
    fields = values if isinstance(values, Mapping) else {"values": values}
    studio = import_extra("eigenshape_studio.widget", "'eigenshape-studio[notebook]'")
    widget = studio.ShapeWidget(surface, fields, height=height)
    if not is_auto(view, up):
        widget.look_from(view, up)
    return widget
