"""Mesh files as they were read, and what they hold besides positions and faces."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.sparse import csr_array, eye_array

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.text import html_repr
from eigenshape._arrays import number_places
from eigenshape._vectors import area_vectors, sum_rows, unit_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.opening import SourceFile

SAME_NORMAL = 1000  # steps from 0 to 1; normals that agree to a step are one


@dataclass(frozen=True)
class Material:
    """The color of a surface, and perhaps an image on it.

    Attributes
    ----------
    name : str
    color : tuple of four float
        Red, green, blue (sRGB, as on a screen) and opacity, from 0 to 1.
    image : bytes, optional
        The PNG or JPEG file of the base color.
    image_name : str
        Name of the image file, without a folder.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.io.Material("bone", color=(0.9, 0.85, 0.7, 1.0)).name
    'bone'
    """

    name: str = ""
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    image: bytes | None = field(default=None, repr=False)
    image_name: str = ""

    _repr_html_ = html_repr


@record
class MeshAttributes(ReadOnly):
    r"""What a mesh file holds besides positions and faces.

    `read_mesh(path, attributes=True)` returns it, `carry_attributes` transfers it to a repaired mesh,
    and `write_mesh(mesh, path, attributes=...)` writes it.

    Attributes
    ----------
    mesh : TriangleMesh
        The mesh that the attributes belong to.
    corners : (3 f, 3 F) sparse matrix
        What the corners of the F faces of the file give to each corner, face by face: its values are
        the product of this matrix and those of the file. Rows have the sum 1.
    face_parts : (f,) int
        Number of the part of the file, such as a primitive of glTF, that each face comes from.
    texture_coordinates : (f, 3, 2) float, optional
        At each corner of a face; v goes up, as in OBJ.
    normals : (f, 3, 3) float, optional
        At each corner, as in the file.
    colors : (f, 3, 4) uint8, optional
        Red, green, blue (sRGB) and opacity at each corner.
    fields : dict of str to array
        Functions with a row for each vertex or for each face, as in `read_fields`.
    face_materials, face_groups : (f,) int
        Number of the material and the group of each face; -1 for none.
    materials : tuple of Material
    groups : tuple of str
        Names of groups (OBJ) or nodes (glTF).
    others : tuple of str
        Names of further content, which only a file of the same format keeps.
    source : SourceFile, optional
        The file.
    places : (n, 3) float, optional
        Where each vertex of `mesh` lies on the mesh of the file, if the two are shapes of their own
        (`es.matching.transfer`). What moves a shape is then fitted to the other one when it is written.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "a.obj")
    >>> _ = path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    >>> mesh, attributes = es.read_mesh(path, attributes=True)
    >>> attributes.texture_coordinates[0].tolist()
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    """

    mesh: TriangleMesh
    corners: csr_array
    face_parts: Int[np.ndarray, " f"]
    face_materials: Int[np.ndarray, " f"]
    face_groups: Int[np.ndarray, " f"]
    texture_coordinates: Float[np.ndarray, "f 3 2"] | None = None
    normals: Float[np.ndarray, "f 3 3"] | None = None
    colors: UInt8[np.ndarray, "f 3 4"] | None = None
    fields: Mapping[str, np.ndarray] = field(default_factory=dict)
    materials: tuple[Material, ...] = ()
    groups: tuple[str, ...] = ()
    others: tuple[str, ...] = ()
    source: SourceFile | None = None
    places: Float[np.ndarray, "n 3"] | None = None

    @classmethod
    def plain(cls, mesh: TriangleMesh) -> "MeshAttributes":
        """Return the attributes of a mesh of which nothing but positions and faces is known.

        Parameters
        ----------
        mesh : TriangleMesh

        Returns
        -------
        MeshAttributes
            Every corner of the file is that of a face. `dataclasses.replace` adds to them.
        """
        require_type(mesh, TriangleMesh, "mesh")
        none = np.full(mesh.n_faces, -1)
        corners = eye_array(3 * mesh.n_faces, format="csr")
        return cls(mesh, corners, none + 1, none, none)

    @property
    def from_file(self) -> Bool[np.ndarray, " f"]:
        """Whether each face is one of the file: each of its corners is one of the same face."""
        are_single = np.diff(self.corners.indptr).reshape(-1, 3) == 1
        owners = self.corners.indices[self.corners.indptr[:-1]].reshape(-1, 3) // 3
        return (are_single & (owners == owners[:, :1])).all(axis=1)

    @property
    def contents(self) -> dict[str, bool]:
        """What there may be besides positions and faces, and whether there is."""
        used = {self.materials[number] for number in np.unique(self.face_materials) if number >= 0}
        return {
            "texture coordinates": self.texture_coordinates is not None,
            "normals": self.normals is not None,
            "vertex colors": self.colors is not None,
            "materials": bool(used),
            "images": any(material.image for material in used),
            "names of groups": any(self.groups),
            "fields": bool(self.fields),
        }


@record
class WriteJob:
    """A mesh to write with its attributes, and a list of what the file does not keep."""

    mesh: TriangleMesh
    path: Path
    suffix: str
    binary: bool
    attributes: MeshAttributes
    face_labels: Int[np.ndarray, " f"] | None
    lost: list[str]

    def lose(self, kinds: Iterable[str], kept: Collection[str] = ()) -> None:
        """Note that further content is lost but for some, and what there is of some kinds of content."""
        contents = self.attributes.contents
        self.lost.extend(other for other in self.attributes.others if other not in kept)
        self.lost.extend(kind for kind in kinds if contents[kind])


def label_attributes(
    attributes: MeshAttributes, labels: Int[np.ndarray, " f"], colors: UInt8[np.ndarray, "n 3"]
) -> MeshAttributes:
    """Replace the materials by one for every label, in the color of its vertices."""
    distinct, numbers = np.unique(labels, return_inverse=True)
    tints = colors[attributes.mesh.faces]  # (f, 3, 3)
    materials = []
    for number, label in enumerate(distinct.tolist()):
        # Vertices at the border of a part may have the color of its neighbor.
        middle = np.median(tints[numbers == number].reshape(-1, 3), axis=0) / 255
        red, green, blue = middle.tolist()
        materials.append(Material(f"part_{label}", (red, green, blue, 1.0)))
    return replace(
        attributes,
        face_materials=numbers,
        materials=tuple(materials),
        colors=None,
        source=None,
    )


def corner_normals(
    attributes: MeshAttributes, mesh: TriangleMesh
) -> Float[np.ndarray, "f 3 3"] | None:
    """Compute the normals of a bent mesh at corners; None if the file had none.

    Corners at one place that had one normal get one again, so that creases stay sharp and seams of
    the texture stay smooth.
    """
    if attributes.normals is None:
        return None
    old = attributes.normals.reshape(-1, 3)
    places = number_places(attributes.mesh.vertices)[attributes.mesh.faces.ravel()]
    groups = number_places(np.column_stack([places, np.rint(old * SAME_NORMAL)]))
    vectors = np.repeat(area_vectors(mesh.vertices[mesh.faces]), 3, axis=0)
    normals = unit_vectors(sum_rows(groups, vectors)[groups])
    # A corner of faces without area keeps its old normal.
    return np.where(normals.any(axis=1, keepdims=True), normals, old).reshape(-1, 3, 3)


def linear_colors(colors: Float[np.ndarray, "*rows"]) -> Float[np.ndarray, "*rows"]:
    """Convert sRGB from 0 to 1 to linear light, which glTF stores (IEC 61966-2-1)."""
    return np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)


def screen_colors(light: Float[np.ndarray, "*rows"]) -> Float[np.ndarray, "*rows"]:
    """Convert linear light to sRGB: the inverse of `linear_colors`."""
    light = light.clip(0.0, 1.0)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
