#!/usr/bin/env bash
# Guess: `read_triangle_mesh` reads the GLB file that `write_triangle_mesh` wrote: 12 triangles of a box.
# Behavior: writing reports success, and reading gives no points and no triangles, with a warning on the
#   terminal and no error. The same box as .gltf comes back.
# Output: glb: written True, read 0 triangles; gltf: written True, read 12 triangles
# Matters: a pipeline that saves GLB loses its shapes at the next step, unless it counts triangles.
# Versions: open3d 0.20.0, numpy 2.4.6, Python 3.11.
# Source: https://github.com/isl-org/Open3D/issues/4376, open since 2021.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet open3d==0.20.0 numpy==2.4.6
env/bin/python - <<'PY'
import open3d as o3d

box = o3d.geometry.TriangleMesh.create_box(1, 2, 3)
box.compute_vertex_normals()
found = {}
for suffix in ("glb", "gltf"):
    written = o3d.io.write_triangle_mesh(f"box.{suffix}", box)
    found[suffix] = written, len(o3d.io.read_triangle_mesh(f"box.{suffix}").triangles)
print(found)
assert found == {"glb": (True, 0), "gltf": (True, 12)}
PY
