"""What is known of a shape before anything is computed: its mesh, attributes and functions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape.io.formats.registry import SHAPE_FORMATS, UPRIGHT, suffix_of
from eigenshape.io.hemispheres import hemisphere_of
from eigenshape.plot.camera import Up, View
from eigenshape_studio.shape.parse import SEAMS, attributes_in, points_in
from eigenshape_studio.shape.sides import recall_side

# Formats of brains, in which x points to the right of the body, y to the front and z up, and where
# the viewer of each hemisphere stands: outside. What is none is seen from the front left.
OF_BRAINS = (".gii", ".surf")
TOWARDS = {"left": (-1.0, 0.0, 0.0), "right": (1.0, 0.0, 0.0), "": (-1.0, 1.0, 0.6)}


@dataclass(frozen=True, eq=False)
class Field:
    """A function on the vertices that was passed to the studio, with its unit."""

    values: np.ndarray
    title: str
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Loaded:
    """What a file, or whoever opens the studio, gives of a shape.

    Attributes
    ----------
    mesh : TriangleMesh
    attributes : MeshAttributes, optional
        What the file of the shape holds besides.
    fields : {name: Field}
        Functions on the vertices.
    side : (view, up)
        From which the page looks, as in `es.plot.aim_camera`.
    points : (p, 3) float, optional
        Those that the surface was made of.
    report : tuple of str
        What was done to the file's shape, in sentences.
    """

    mesh: es.TriangleMesh
    attributes: es.io.MeshAttributes | None = None
    fields: Mapping[str, Field] = field(default_factory=dict)
    side: tuple[View, Up] = ("auto", "auto")
    points: np.ndarray | None = None
    report: tuple[str, ...] = ()


def load_file(path: str | Path) -> Loaded:
    """Read a shape with what else its file holds."""
    path = Path(path)
    found = es.io.read_surface(path, repair=SEAMS)
    mesh = found.mesh
    attributes = attributes_in(path, mesh)
    # The page can choose from the functions in the file that it can draw.
    values = {
        title: numbers
        for title, numbers in (attributes.fields.items() if attributes else ())
        if _is_field(numbers, mesh.n_vertices)
    }
    fields = check_fields(values, mesh.n_vertices)
    side: tuple[View, Up] = ("auto", "auto")
    if recall_side(mesh) is None:  # nobody has turned this shape
        suffix = suffix_of(path, None, SHAPE_FORMATS)
        if suffix in OF_BRAINS:
            side = (TOWARDS[hemisphere_of(mesh)], "z")
        elif suffix in UPRIGHT:
            side = ("auto", "y")
    points = points_in(path, found.report)
    return Loaded(mesh, attributes, fields, side, points, found.report)


def check_fields(values: Mapping[str, Any], n_vertices: int) -> dict[str, Field]:
    """Return the functions that were passed.

    Raises
    ------
    InvalidParameterError
        If one of them does not have a finite number or NaN for each vertex, or no number at all.
    """
    fields = {}
    for title, given in values.items():
        numbers = np.asarray(given, dtype=np.float64)
        if not _is_field(numbers, n_vertices):
            raise es.InvalidParameterError(
                f"values must hold one finite number for each of the {n_vertices} vertices, or NaN "
                f"where there is none, and at least one number; {title!r} has the shape "
                f"{numbers.shape}, {np.isfinite(numbers).sum()} finite numbers and "
                f"{np.isinf(numbers).sum()} infinite ones. Values "
                "of faces become those of vertices by es.calculus.average_onto_points(mesh, values)."
            )
        # "height (m)" is a title with its unit.
        text, _, unit = str(title).removesuffix(")").partition(" (")
        fields[str(title).replace("/", " ")] = Field(numbers, text, unit)
    return fields


def _is_field(values: np.ndarray, n_vertices: int) -> bool:
    """Tell whether the page can draw a function: a number or NaN at each vertex, and not NaN at all."""
    return (
        values.shape == (n_vertices,) and not np.isinf(values).any() and not np.isnan(values).all()
    )
