"""What is known of a shape before anything is computed: its mesh, attributes and functions."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape.plot.camera import Up, View


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
    """

    mesh: es.TriangleMesh
    attributes: es.io.MeshAttributes | None = None
    fields: Mapping[str, Field] = field(default_factory=dict)
    side: tuple[View, Up] = ("auto", "auto")


def load_file(path: str | Path) -> Loaded:
    """Read a shape with what else its file holds."""
    path, mesh = Path(path), es.io.read_surface(path).mesh
    attributes, values = None, {}
    with suppress(es.FileFormatError):  # points have no attributes
        attributes = es.read_mesh(path, attributes=True, drop_missing=True)[1]
        attributes = es.io.carry_attributes(attributes, mesh)
        # The page can choose from the functions in the file that it can draw.
        values = {
            title: numbers
            for title, numbers in attributes.fields.items()
            if numbers.shape == (mesh.n_vertices,) and np.isfinite(numbers).all()
        }
    return Loaded(mesh, attributes, check_fields(values, mesh.n_vertices))


def check_fields(values: Mapping[str, Any], n_vertices: int) -> dict[str, Field]:
    """Return the functions that were passed.

    Raises
    ------
    InvalidParameterError
        If one of them does not have one finite number for each vertex.
    """
    fields = {}
    for title, given in values.items():
        numbers = np.asarray(given, dtype=np.float64)
        if numbers.shape != (n_vertices,) or not np.isfinite(numbers).all():
            raise es.InvalidParameterError(
                f"values must hold one finite number for each of the {n_vertices} vertices; "
                f"{title!r} has the shape {numbers.shape}."
            )
        # "height (m)" is a title with its unit.
        text, _, unit = str(title).removesuffix(")").partition(" (")
        fields[str(title).replace("/", " ")] = Field(numbers, text, unit)
    return fields
