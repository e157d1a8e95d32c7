"""trimesh writes and reads."""

from pathlib import Path

import numpy as np
import trimesh
from exchange import Shape, Writer, field_arrays, plain_fields, serve
from scipy.spatial.transform import Rotation


def mesh_of(shape: Shape) -> trimesh.Trimesh:
    """Return a shape as trimesh has it: triangles, with what belongs to their corners."""
    mesh = trimesh.Trimesh(shape["points"], shape["triangles"], process=False)
    if "colors" in shape:
        mesh.visual.vertex_colors = np.array(shape["colors"], np.uint8)
    if "texture" in shape:
        mesh.visual = trimesh.visual.TextureVisuals(uv=np.array(shape["texture"]))
    for name, values in field_arrays(shape.get("point_fields", {})).items():
        if " " not in name and values.ndim == 1:
            mesh.vertex_attributes[name] = (
                values.astype(np.uint8) if values.dtype == bool else values
            )
    for name, values in field_arrays(shape.get("cell_fields", {})).items():
        mesh.face_attributes[name] = values[shape["owners"]]
        if values.dtype == bool:
            mesh.face_attributes[name] = mesh.face_attributes[name].astype(np.uint8)
    return mesh


def write(shape: Shape, path: Path, **options: object) -> None:
    """Write a shape; copies are nodes of a scene that share one mesh."""
    mesh = mesh_of(shape)
    if "copies" not in shape:
        mesh.export(path, **options)
        return
    scene = trimesh.Scene()
    scene.add_geometry(
        mesh, geom_name="box", node_name="first", transform=place(shape["copies"][0])
    )
    for number, copy in enumerate(shape["copies"][1:]):
        scene.graph.update(frame_to=f"box{number}", matrix=place(copy), geometry="box")
    scene.export(path, **options)


def place(copy: dict[str, list[float]]) -> np.ndarray:
    """Return the matrix of a copy."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(copy["rotation"]).as_matrix() * copy["scale"]
    matrix[:3, 3] = copy["translation"]
    return matrix


def write_gltf(shape: Shape, path: Path) -> None:
    """Write a .gltf file and what lies beside it."""
    for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh_of(shape))).items():
        path.with_name(path.name if name == "model.gltf" else name).write_bytes(data)


def read(path: Path) -> Shape:
    """Read a file as one mesh."""
    scene = trimesh.load_scene(path, process=False, maintain_order=True)
    mesh = scene.to_mesh()
    found = {"points": mesh.vertices, "polygons": mesh.faces}
    if mesh.visual.kind == "vertex":
        found["colors"] = mesh.visual.vertex_colors
    if mesh.visual.kind == "texture" and mesh.visual.uv is not None:
        found["texture"] = mesh.visual.uv
    found["point_fields"] = plain_fields(mesh.vertex_attributes)
    found["cell_fields"] = plain_fields(mesh.face_attributes)
    # Columns of PLY that trimesh has no place for stand as they are in the metadata.
    raw = next(iter(scene.geometry.values())).metadata.get("_ply_raw", {})
    for key, element in (("point_fields", "vertex"), ("cell_fields", "face")):
        table = raw.get(element, {}).get("data")
        names = (table.dtype.names or ()) if hasattr(table, "dtype") else table or ()
        found[key] |= plain_fields({name: np.asarray(table[name]).ravel() for name in names})
    return found


def text_ply(shape: Shape, path: Path) -> None:
    """Write a PLY file of text."""
    write(shape, path, encoding="ascii")


def text_stl(shape: Shape, path: Path) -> None:
    """Write an STL file of text."""
    write(shape, path, file_type="stl_ascii")


if __name__ == "__main__":
    serve(
        trimesh.__version__,
        {
            "PLY": Writer(".ply", write, ("seam", "colors", "far", "fields", "copies")),
            "PLY, text": Writer(".ply", text_ply, ("seam", "colors", "far", "fields")),
            "OBJ": Writer(".obj", write, ("seam", "colors", "far", "copies")),
            "OFF": Writer(".off", write, ("seam", "colors", "far")),
            "STL": Writer(".stl", write, ("seam", "copies", "far")),
            "STL, text": Writer(".stl", text_stl, ("seam", "far")),
            "GLB": Writer(".glb", write, ("seam", "colors", "far", "copies")),
            "glTF": Writer(".gltf", write_gltf, ("seam", "colors", "far")),
        },
        dict.fromkeys((".ply", ".obj", ".off", ".stl", ".glb", ".gltf"), read),
    )
