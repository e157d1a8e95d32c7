"""MeshLab writes and reads."""

from importlib.metadata import version
from pathlib import Path

import numpy as np
from exchange import Shape, Writer, field_arrays, plain_fields, serve
from pymeshlab import pmeshlab


def mesh_of(shape: Shape) -> pmeshlab.Mesh:
    """Return a shape as MeshLab has it: triangles, some of whose sides are hidden."""
    given = {}
    if "colors" in shape:
        shares = np.array(shape["colors"]) / 255
        given["v_color_matrix"] = np.column_stack([shares, np.ones(len(shares))])
    if "texture" in shape:
        given["v_tex_coords_matrix"] = np.array(shape["texture"])
    points = np.array(shape["points"])
    if "owners" in shape and len(shape["polygons"]) < len(shape["triangles"]):
        polygons = [np.array(corners, dtype=np.uint32) for corners in shape["polygons"]]
        mesh = pmeshlab.Mesh(vertex_matrix=points, face_list_of_indices=polygons, **given)
    else:
        triangles = np.array(shape["triangles"], dtype=np.int32)
        mesh = pmeshlab.Mesh(vertex_matrix=points, face_matrix=triangles, **given)
    for name, values in field_arrays(shape.get("point_fields", {})).items():
        if " " not in name and values.ndim == 1:
            mesh.add_vertex_custom_scalar_attribute(values.astype(float), name)
    return mesh


def write(shape: Shape, path: Path, **options: bool) -> None:
    """Write a shape."""
    meshes = pmeshlab.MeshSet()
    meshes.add_mesh(mesh_of(shape))
    meshes.save_current_mesh(str(path), **options)


def write_text(shape: Shape, path: Path) -> None:
    """Write text."""
    write(shape, path, binary=False)


def read(path: Path) -> Shape:
    """Read a file by its suffix."""
    meshes = pmeshlab.MeshSet()
    meshes.load_new_mesh(str(path))
    if meshes.mesh_number() > 1:
        meshes.generate_by_merging_visible_meshes(mergevertices=False)
    mesh = meshes.current_mesh()
    found: Shape = {"points": mesh.transformed_vertex_matrix(), "polygons": mesh.face_matrix()}
    if mesh.has_vertex_color():
        found["colors"] = mesh.vertex_color_matrix() * 255
    if mesh.has_wedge_tex_coord():
        found["corner_texture"] = mesh.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    elif mesh.has_vertex_tex_coord():
        found["texture"] = mesh.vertex_tex_coord_matrix()
    fields = {}
    for name in ("mask", "level", "step", "label", "count", "low", "height"):
        try:
            fields[name] = mesh.vertex_custom_scalar_attribute_array(name)
        except Exception:  # noqa: BLE001 there is no such attribute
            continue
    found["point_fields"] = plain_fields(fields)
    return found


if __name__ == "__main__":
    # MeshLab does not come to an end when it joins the triangles of the plate with a hole (OBJ, OFF).
    faces = ("prism", "colors", "far")
    serve(
        version("pymeshlab"),
        {
            "PLY": Writer(".ply", write, (*faces, "hole", "seam", "fields")),
            "PLY, text": Writer(".ply", write_text, (*faces, "hole", "seam")),
            "OBJ": Writer(".obj", write, (*faces, "seam")),
            "OFF": Writer(".off", write, faces),
            "STL": Writer(".stl", write, ("prism", "far")),
            "STL, text": Writer(".stl", write_text, ("prism", "far")),
        },
        dict.fromkeys((".ply", ".obj", ".off", ".stl", ".glb", ".gltf"), read),
    )
