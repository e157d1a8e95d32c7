#!/usr/bin/env bash
# Guess: a node that mirrors its mesh is read with its triangles reversed, so that a solid keeps its outside:
#   the format says that a negative determinant reverses them.
# Behavior: Open3D and VTK move the points and keep the order of corners, so the solid is inside out. trimesh
#   reverses them.
# Output: volume of a mirrored unit cube: Open3D -1, VTK -1, trimesh 1
# Matters: the right half of most symmetric characters is a mirrored copy; normals, volumes and offsets of it
#   have the wrong sign.
# Versions: open3d 0.20.0, vtk 9.7.2, trimesh 5.2.0, numpy 2.4.6, Python 3.11.
# Source: glTF 2.0, 3.5.3 ("if the determinant is a negative value, the winding order of the mesh triangle
#   faces should be reversed"); https://github.com/KhronosGroup/glTF/issues/1697.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet open3d==0.20.0 vtk==9.7.2 trimesh==5.2.0 numpy==2.4.6
env/bin/python - <<'PY'
import json
import struct
from pathlib import Path

import numpy as np
import open3d as o3d
import trimesh
import vtk
from vtk.util.numpy_support import vtk_to_numpy

# trimesh writes a cube as GLB; its node is then mirrored in x.
data = trimesh.Scene(trimesh.creation.box()).export(file_type="glb")
n_text = struct.unpack("<I", data[12:16])[0]
tree, rest = json.loads(data[20 : 20 + n_text]), data[20 + n_text :]
(node,) = [node for node in tree["nodes"] if "mesh" in node]
node.pop("matrix", None)
node["scale"] = [-1, 1, 1]
text = json.dumps(tree).encode()
text += b" " * (-len(text) % 4)
head = struct.pack("<4s4I4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0, b"")[:16]
Path("a.glb").write_bytes(head + b"JSON" + text + rest)


def volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """Return the volume inside, which is negative if the triangles face inward."""
    return round(float(np.linalg.det(points[triangles]).sum() / 6), 6)


mesh = trimesh.load_scene("a.glb").to_mesh()
found = {"trimesh": volume(mesh.vertices, mesh.faces)}
mesh = o3d.io.read_triangle_mesh("a.glb")
found["Open3D"] = volume(np.asarray(mesh.vertices), np.asarray(mesh.triangles))
reader = vtk.vtkGLTFReader(file_name="a.glb")
surface = vtk.vtkCompositeDataGeometryFilter()
surface.SetInputConnection(reader.GetOutputPort())
surface.Update()
polygons = surface.GetOutput()
corners = vtk_to_numpy(polygons.GetPolys().GetConnectivityArray()).reshape(-1, 3)
found["VTK"] = volume(vtk_to_numpy(polygons.GetPoints().GetData()).astype(float), corners)
print(found)
assert found == {"trimesh": 1.0, "Open3D": -1.0, "VTK": -1.0}
PY
