#!/usr/bin/env bash
# Guess: a glTF primitive of mode 6, a triangle fan, is read as triangles, as those of mode 4 and 5 are.
# Behavior: trimesh reads triangles and strips, and leaves fans out: the scene is empty, without an error or a
#   warning.
# Output: strip: 3 triangles; fan: 0 triangles
# Matters: if a file mixes modes, parts of a shape are missing in silence.
# Versions: trimesh 5.2.0, numpy 2.4.6, Python 3.11.
# Source: glTF 2.0, 3.7.2.1, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html#meshes-overview;
#   _read_buffers in trimesh/exchange/gltf.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet trimesh==5.2.0 numpy==2.4.6
env/bin/python - <<'PY'
import base64
import json
from pathlib import Path

import numpy as np
import trimesh

POINTS = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 2, 0], [0, 1, 0]], "<f4")  # convex
URI = "data:application/octet-stream;base64," + base64.b64encode(POINTS.tobytes()).decode()


def count_triangles(mode: int) -> int:
    """Write five points as a strip (5) or a fan (6), and count what is read."""
    accessor = {"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"}
    Path("a.gltf").write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode}]}],
        "accessors": [accessor | {"min": [0, 0, 0], "max": [2, 2, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 60}], "buffers": [{"byteLength": 60, "uri": URI}],
    }))
    return sum(len(mesh.faces) for mesh in trimesh.load_scene("a.gltf").geometry.values())


found = {"strip": count_triangles(5), "fan": count_triangles(6)}
print(found)
assert found == {"strip": 3, "fan": 0}
PY
