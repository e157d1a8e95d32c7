#!/usr/bin/env bash
# Guess: integers of an accessor with `normalized: true` are fractions: 65535 of 16 bits means 1, and 32767
#   with a sign, too.
# Behavior: trimesh keeps the low byte of colors of 16 bits, which is noise, and takes positions of
#   KHR_mesh_quantization as the integers that store them. Colors of 8 bits are right.
# Output: color 0.5 0.25 0.125 in 16 bits: 0 0 0, in 8 bits: 128 64 32; position 1 in 16 bits: 32767.0
# Matters: 16 bits are what quantizing exporters choose for both. The shape comes out 32,767 times too large,
#   or its colors at random, without an error.
# Versions: trimesh 5.2.0, numpy 2.4.6, Python 3.11.
# Source: glTF 2.0, 3.6.2.2;
#   https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_mesh_quantization.
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

TYPES = {"<f4": 5126, "<i2": 5122, "<u2": 5123, "|u1": 5121}
UNIT = np.array([[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]])  # rows fill up whole groups of four bytes


def read(points: np.ndarray, colors: np.ndarray, extensions: list[str]) -> trimesh.Trimesh:
    """Write a triangle with colors as glTF, and read it."""
    data = points.tobytes() + colors.tobytes()
    views, accessors = [], []
    for values, start, kind in ((points, 0, "VEC3"), (colors, points.nbytes, "VEC4")):
        row = values.strides[0]
        views.append({"buffer": 0, "byteOffset": start, "byteLength": 3 * row, "byteStride": row})
        accessors.append({"bufferView": len(accessors), "componentType": TYPES[values.dtype.str]})
        accessors[-1] |= {"count": 3, "type": kind, "normalized": values.dtype.kind != "f"}
    accessors[0] |= {"min": [0, 0, 0], "max": points.max(axis=0)[:3].tolist()}
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    tree = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}}]}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data), "uri": uri}],
    }  # fmt: skip
    if extensions:
        tree |= {"extensionsUsed": extensions, "extensionsRequired": extensions}
    Path("a.gltf").write_text(json.dumps(tree))
    return trimesh.load_mesh("a.gltf", process=False)


floats, integers = UNIT.astype("<f4"), (32767 * UNIT).astype("<i2")
wide = np.array([[0x8000, 0x4000, 0x2000, 0xFFFF]] * 3, "<u2")
narrow = (wide >> 8).astype("u1")
found = [read(floats, colors, []).visual.vertex_colors[0, :3].tolist() for colors in (wide, narrow)]
size = float(read(integers, narrow, ["KHR_mesh_quantization"]).vertices.max())
print("16 bits", found[0], "8 bits", found[1], "position 1:", size)
assert found == [[0, 0, 0], [128, 64, 32]]
assert size == 32767.0
PY
