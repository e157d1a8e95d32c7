#!/usr/bin/env bash
# Guess: a glTF accessor with `sparse` values is read with these values in place.
# Behavior: trimesh and MeshLab read the array below and leave the sparse values out; Open3D puts them in
#   place. The format lets any accessor be sparse, and no extension announces it.
# Output: the third point has y = 1 in trimesh and MeshLab, y = 5 in Open3D; the file says 5
# Matters: exporters store what differs from a common base, such as targets, as sparse: the shape is then
#   another one, without an error.
# Versions: trimesh 5.2.0, pymeshlab 2025.7.post1, open3d 0.20.0, numpy 2.4.6, Python 3.11.
# Source: glTF 2.0, 3.6.2.3, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html#sparse-accessors.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet trimesh==5.2.0 pymeshlab==2025.7.post1 open3d==0.20.0 numpy==2.4.6
env/bin/python - <<'PY'
import base64
import json
from pathlib import Path

import numpy as np
import open3d as o3d
import pymeshlab
import trimesh

points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
places = np.array([2, 0], "<u2").tobytes()  # the second number fills up four bytes
values = np.array([[0, 5, 0]], "<f4").tobytes()
data = points + places + values
sparse = {"count": 1, "indices": {"bufferView": 1, "byteOffset": 0, "componentType": 5123}}
sparse["values"] = {"bufferView": 2, "byteOffset": 0}
position = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}
position |= {"min": [0, 0, 0], "max": [1, 5, 0]}
uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
views = [(0, 36), (36, 2), (40, 12)]
Path("a.gltf").write_text(json.dumps({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [position], "buffers": [{"byteLength": len(data), "uri": uri}],
    "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": n} for at, n in views],
}))
meshes = pymeshlab.MeshSet()
meshes.load_new_mesh("a.gltf")
found = {
    "trimesh": trimesh.load_mesh("a.gltf", process=False).vertices[:, 1].max(),
    "MeshLab": meshes.current_mesh().vertex_matrix()[:, 1].max(),
    "Open3D": np.asarray(o3d.io.read_triangle_mesh("a.gltf").vertices)[:, 1].max(),
}
print(found)
assert found == {"trimesh": 1.0, "MeshLab": 1.0, "Open3D": 5.0}
PY
