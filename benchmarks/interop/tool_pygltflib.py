"""pygltflib writes what one tells it: accessors, nodes, skins, targets and instances, each by hand.

It reads entries and bytes, and not where they are; so it reads here no file alone.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
from exchange import Shape, Writer, serve

KINDS = {
    "f": pygltflib.FLOAT,
    "B": pygltflib.UNSIGNED_BYTE,
    "H": pygltflib.UNSIGNED_SHORT,
    "I": pygltflib.UNSIGNED_INT,
}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Document:
    """A glTF file of one buffer, to which arrays are added."""

    def __init__(self) -> None:
        """Begin without anything."""
        self.gltf = pygltflib.GLTF2(scene=0, scenes=[pygltflib.Scene(nodes=[0])])
        self.data = b""

    def view(self, data: bytes) -> int:
        """Add bytes, from a multiple of four on."""
        self.data += b"\0" * (-len(self.data) % 4)
        view = pygltflib.BufferView(buffer=0, byteOffset=len(self.data), byteLength=len(data))
        self.gltf.bufferViews.append(view)
        self.data += data
        return len(self.gltf.bufferViews) - 1

    def add(self, rows: Any, kind: str = "f", **entry: Any) -> int:
        """Add an array, and return the number of its accessor."""
        rows = np.ascontiguousarray(rows, dtype=kind)
        rows = rows.reshape(len(rows), -1)
        facts = {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        accessor = pygltflib.Accessor(
            bufferView=self.view(rows.tobytes()),
            componentType=KINDS[kind],
            count=len(rows),
            type=TYPES[rows.shape[1]],
            **facts,
            **entry,
        )
        self.gltf.accessors.append(accessor)
        return len(self.gltf.accessors) - 1

    def add_sparse(self, rows: Any) -> int:
        """Add an array whose rows are zero but for some, which are listed (3.6.2.3)."""
        rows = np.ascontiguousarray(rows, dtype="f")
        used = np.flatnonzero(rows.any(axis=1)).astype("H")
        indices = pygltflib.AccessorSparseIndices(
            bufferView=self.view(used.tobytes()), componentType=KINDS["H"]
        )
        values = pygltflib.AccessorSparseValues(bufferView=self.view(rows[used].tobytes()))
        sparse = pygltflib.Sparse(count=len(used), indices=indices, values=values)
        accessor = pygltflib.Accessor(
            componentType=KINDS["f"], count=len(rows), type=TYPES[rows.shape[1]], sparse=sparse,
            min=rows.min(axis=0).tolist(), max=rows.max(axis=0).tolist(),
        )  # fmt: skip
        self.gltf.accessors.append(accessor)
        return len(self.gltf.accessors) - 1

    def save(self, path: Path) -> None:
        """Write the file."""
        self.gltf.buffers = [pygltflib.Buffer(byteLength=len(self.data))]
        self.gltf.set_binary_blob(self.data)
        if path.suffix == ".gltf":
            self.gltf.convert_buffers(pygltflib.BufferFormat.DATAURI)
        self.gltf.save(path)


def document_of(shape: Shape, color_kind: str = "f") -> Document:
    """Return a document with one mesh, on node 0."""
    document = Document()
    # Vertices are told by their distance from the first one, so that single precision suffices.
    points = np.array(shape["points"])
    offset = points[0] if np.abs(points).max() > 1e5 else np.zeros(3)
    attributes = pygltflib.Attributes(POSITION=document.add(points - offset))
    if "colors" in shape:
        share = np.array(shape["colors"]) / 255
        light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
        if color_kind == "f":
            attributes.COLOR_0 = document.add(light)
        else:
            opaque = np.column_stack([light, np.ones(len(light))])
            whole = np.rint(opaque * np.iinfo(color_kind).max)
            attributes.COLOR_0 = document.add(whole, color_kind, normalized=True)
    material = None
    if "texture" in shape:
        coordinates = np.array(shape["texture"]) * [1, -1] + [0, 1]  # v goes down
        attributes.TEXCOORD_0 = document.add(coordinates)
    if "weights" in shape and "joint_nodes" in shape:
        weights = np.zeros((len(points), 4))
        weights[:, :2] = shape["weights"]
        joints = np.tile([0, 1, 0, 0], (len(points), 1)) * (weights > 0)
        attributes.JOINTS_0, attributes.WEIGHTS_0 = document.add(joints, "B"), document.add(weights)
    indices = document.add(np.ravel(shape["triangles"]), "H")
    primitive = pygltflib.Primitive(attributes=attributes, indices=indices, material=material)
    document.gltf.meshes = [pygltflib.Mesh(primitives=[primitive])]
    document.gltf.nodes = [pygltflib.Node(mesh=0, translation=offset.tolist())]
    return document


def write(shape: Shape, path: Path) -> None:
    """Write one mesh; copies are nodes."""
    document = document_of(shape)
    if "copies" in shape:
        document.gltf.nodes = [pygltflib.Node(mesh=0, **copy) for copy in shape["copies"]]
        document.gltf.scenes[0].nodes = list(range(len(shape["copies"])))
    document.save(path)


def write_colors(kind: str) -> Any:
    """Return a call that writes colors of one type."""

    def write_kind(shape: Shape, path: Path) -> None:
        document_of(shape, kind).save(path)

    return write_kind


def write_instances(shape: Shape, path: Path) -> None:
    """Write copies by EXT_mesh_gpu_instancing, which is used and not required."""
    document = document_of(shape)
    columns = {
        name.upper(): document.add([copy[name] for copy in shape["copies"]])
        for name in ("translation", "rotation", "scale")
    }
    name = "EXT_mesh_gpu_instancing"
    document.gltf.nodes[0].extensions = {name: {"attributes": columns}}
    document.gltf.extensionsUsed = [name]
    document.save(path)


def write_skin(shape: Shape, path: Path) -> None:
    """Write a mesh with a skin below its armature."""
    document = document_of(shape)
    columns = [np.array(matrix).T.ravel() for matrix in shape["inverse_binds"]]
    low, high = shape["joint_nodes"]
    document.gltf.nodes = [
        pygltflib.Node(name="Armature", children=[1, 2], **shape["armature"]),
        pygltflib.Node(name="Body", mesh=0, skin=0),
        pygltflib.Node(name="low", children=[3], **low),
        pygltflib.Node(name="high", **high),
    ]
    skin = pygltflib.Skin(joints=[2, 3], inverseBindMatrices=document.add(columns))
    document.gltf.skins = [skin]
    document.save(path)


def write_targets(shape: Shape, path: Path, *, sparse: bool = False) -> None:
    """Write targets with weights of the mesh; a node of pygltflib has no weights."""
    document = document_of(shape)
    add = document.add_sparse if sparse else document.add
    mesh = document.gltf.meshes[0]
    mesh.primitives[0].targets = [{"POSITION": add(target)} for target in shape["targets"]]
    mesh.weights = shape["weights"]
    document.save(path)


def write_sparse_targets(shape: Shape, path: Path) -> None:
    """Write sparse targets."""
    write_targets(shape, path, sparse=True)


if __name__ == "__main__":
    serve(
        pygltflib.__version__,
        {
            "GLB": Writer(".glb", write, ("prism", "hole", "seam", "colors", "far", "copies")),
            "glTF": Writer(".gltf", write, ("prism", "hole", "seam", "colors", "far", "copies")),
            "GLB, 8 bits": Writer(".glb", write_colors("B"), ("colors",)),
            "GLB, 16 bits": Writer(".glb", write_colors("H"), ("colors",)),
            "GLB, instances": Writer(".glb", write_instances, ("copies",)),
            "GLB, skin": Writer(".glb", write_skin, ("skin",)),
            "glTF, skin": Writer(".gltf", write_skin, ("skin",)),
            "GLB, targets": Writer(".glb", write_targets, ("morph",)),
            "GLB, sparse targets": Writer(".glb", write_sparse_targets, ("morph",)),
        },
        {},
    )
