"""A shape whose faces have labels."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Int

from eigenshape._arrays import ReadOnly, face_labels, freeze
from eigenshape._text import short_repr
from eigenshape.geometry.conversion import as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.labels.label_points import LabelPoints, label_points


@dataclass(frozen=True, eq=False)
class LabeledShape(ReadOnly):
    """A shape with a label on each face, from which `transfer_labels` copies.

    The shape is described when its labels are first transferred, and the description is kept, so
    that one shape labels many at little more than the cost of their descriptions.

    Attributes
    ----------
    mesh : TriangleMesh
        Or what `as_mesh` takes.
    labels : (f,) int
        Label of each face. A label means the same on all shapes that are used together.

    Raises
    ------
    InvalidParameterError
        If `labels` are not f integers.

    See Also
    --------
    transfer_labels, es.io.read_labeled_shapes

    Examples
    --------
    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=500)
    >>> labeled = es.retrieval.LabeledShape(fish, es.find_parts(fish).parts.labels)
    >>> labeled.mesh.n_faces == len(labeled.labels)
    True
    """

    mesh: TriangleMesh
    labels: Int[np.ndarray, " f"]

    def __post_init__(self) -> None:
        mesh = as_mesh(self.mesh)
        labels = face_labels(self.labels, "labels", mesh.n_faces)
        object.__setattr__(self, "mesh", mesh)
        object.__setattr__(self, "labels", freeze(labels.astype(np.int64)))

    __repr__ = short_repr

    @cached_property
    def points(self) -> LabelPoints:
        """Return the points that are matched with those of other shapes."""
        return label_points(self.mesh)
