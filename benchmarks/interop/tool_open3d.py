"""Open3D writes and reads."""

from pathlib import Path

import numpy as np
import open3d as o3d
from exchange import Shape, Writer, serve


def write(shape: Shape, path: Path, **options: bool) -> None:
    """Write a mesh of triangles."""
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(np.array(shape["points"])),
        o3d.utility.Vector3iVector(np.array(shape["triangles"], dtype=np.int32)),
    )
    if "colors" in shape:
        mesh.vertex_colors = o3d.utility.Vector3dVector(np.array(shape["colors"]) / 255)
    if "texture" in shape:
        corners = np.array(shape["texture"])[np.array(shape["triangles"])].reshape(-1, 2)
        mesh.triangle_uvs = o3d.utility.Vector2dVector(corners)
    if path.suffix == ".stl":
        mesh.compute_vertex_normals()
    if not o3d.io.write_triangle_mesh(str(path), mesh, **options):
        raise ValueError("Open3D did not write the file")


def write_text(shape: Shape, path: Path) -> None:
    """Write a mesh as text."""
    write(shape, path, write_ascii=True)


def read(path: Path) -> Shape:
    """Read a mesh of triangles."""
    mesh = o3d.io.read_triangle_mesh(str(path))
    if not len(mesh.triangles):
        raise ValueError("Open3D read no triangles")
    found: Shape = {"points": np.asarray(mesh.vertices), "polygons": np.asarray(mesh.triangles)}
    if mesh.has_vertex_colors():
        found["colors"] = np.asarray(mesh.vertex_colors) * 255
    if mesh.has_triangle_uvs():
        found["corner_texture"] = np.asarray(mesh.triangle_uvs).reshape(-1, 3, 2)
    return found


if __name__ == "__main__":
    plain = ("colors", "far")
    serve(
        o3d.__version__,
        {
            "PLY": Writer(".ply", write, plain),
            "PLY, text": Writer(".ply", write_text, plain),
            "OBJ": Writer(".obj", write, ("seam", *plain)),
            "OFF": Writer(".off", write, plain),
            "STL": Writer(".stl", write, ("far",)),
            "GLB": Writer(".glb", write, ("seam", *plain)),
            "glTF": Writer(".gltf", write, ("seam", *plain)),
        },
        dict.fromkeys((".ply", ".obj", ".off", ".stl", ".glb", ".gltf"), read),
    )
