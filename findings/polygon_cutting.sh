#!/usr/bin/env bash
# Guess: an L-shaped face of area 3 has area 3 after reading, in any library and any format that holds
#   polygons.
# Behavior: trimesh and libigl cut every polygon from its first corner, also one that is not convex: area 4,
#   with triangles outside. MeshLab does so for PLY, and cuts OBJ and OFF rightly. Open3D cuts PLY and OFF
#   rightly, and leaves faces of OBJ with more corners out.
# Output: area 3 for MeshLab obj, off and Open3D ply, off; 4 for trimesh obj, ply, off, libigl obj, off,
#   MeshLab ply; 0 for Open3D obj
# Matters: CAD programs and Blender write such polygons. Area, volume and distances are wrong, and which files
#   are right depends on the suffix.
# Versions: trimesh 5.2.0, libigl 2.6.3, pymeshlab 2025.7.post1, open3d 0.20.0, numpy 2.4.6, Python 3.11.
# Source: triangulate_quads in trimesh/geometry.py, igl::polygons_to_triangles, FileASSIMP.cpp of Open3D
#   ("Skipping non-triangle primitive geometry").
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet trimesh==5.2.0 libigl==2.6.3 pymeshlab==2025.7.post1 open3d==0.20.0 numpy==2.4.6
env/bin/python - <<'PY'
from pathlib import Path

import igl
import numpy as np
import open3d as o3d
import pymeshlab
import trimesh

CORNERS = [(2, 0), (2, 1), (1, 1), (1, 2), (0, 2), (0, 0)]
rows = [f"{x} {y} 0\n" for x, y in CORNERS]
Path("L.obj").write_text("".join("v " + row for row in rows) + "f 1 2 3 4 5 6\n")
Path("L.off").write_text("OFF\n6 1 0\n" + "".join(rows) + "6 0 1 2 3 4 5\n")
axes = "".join(f"property float {axis}\n" for axis in "xyz")
lists = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
head = f"ply\nformat ascii 1.0\nelement vertex 6\n{axes}{lists}"
Path("L.ply").write_text(head + "".join(rows) + "6 0 1 2 3 4 5\n")


def area(points: np.ndarray, triangles: np.ndarray) -> float:
    """Return the area of triangles."""
    a, b, c = np.asarray(points)[np.asarray(triangles, dtype=int).reshape(-1, 3)].swapaxes(0, 1)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


found = {}
for name in ("L.obj", "L.off", "L.ply"):
    mesh = trimesh.load_mesh(name)
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(name)
    lab = meshes.current_mesh()
    other = o3d.io.read_triangle_mesh(name)
    found[name] = area(mesh.vertices, mesh.faces), area(lab.vertex_matrix(), lab.face_matrix())
    found[name] += (area(other.vertices, other.triangles),)
print("trimesh, MeshLab, Open3D:", found)
print("libigl:", area(*igl.read_triangle_mesh("L.obj")[:2]))
assert found == {"L.obj": (4, 3, 0), "L.off": (4, 3, 3), "L.ply": (4, 4, 3)}
assert area(*igl.read_triangle_mesh("L.obj")[:2]) == 4
PY
