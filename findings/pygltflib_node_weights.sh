#!/usr/bin/env bash
# Guess: `GLTF2.load` and `save` keep what the format defines, so also the weights of morph targets at a node.
# Behavior: the class Node has no field for them. They are gone after loading and saving, without a warning;
#   those of a mesh stay.
# Output: weights of the node before [0.5, 0.25], after None; of the mesh before and after [0, 0]
# Matters: weights of a node win over those of its mesh, so the saved file shows another shape: a face at rest
#   in place of a smile.
# Versions: pygltflib 1.16.5, Python 3.11.
# Source: glTF 2.0, 5.25.11 node.weights,
#   https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html#_node_weights.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet pygltflib==1.16.5
env/bin/python - <<'PY'
import json
from pathlib import Path

import pygltflib

targets = [{"POSITION": 1}, {"POSITION": 2}]
column = {"componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]}
Path("a.gltf").write_text(json.dumps({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0, "weights": [0.5, 0.25]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "targets": targets}], "weights": [0, 0]}],
    "accessors": [column, column, column],
}))
pygltflib.GLTF2().load("a.gltf").save("b.gltf")
before, after = (json.loads(Path(name).read_text()) for name in ("a.gltf", "b.gltf"))
for tree in (before, after):
    print("node", tree["nodes"][0].get("weights"), "mesh", tree["meshes"][0].get("weights"))
assert "weights" in before["nodes"][0]
assert "weights" not in after["nodes"][0]
assert after["meshes"][0]["weights"] == [0, 0]
PY
