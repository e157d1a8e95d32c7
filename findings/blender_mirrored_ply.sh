#!/usr/bin/env bash
# Guess: Blender exports an object that is mirrored by a negative scale with its faces outward, in PLY as in
#   OBJ and STL.
# Behavior: the exporters of OBJ and STL reverse the corners of such an object, and that of PLY does not: the
#   solid in the PLY file is inside out.
# Output: volume of a mirrored box of 2: ply -2.0, obj 2.0, stl 2.0
# Matters: volumes, normals and offsets of the PLY file have the wrong sign, and several objects in one file
#   face both ways.
# Versions: bpy 4.5.15 (Blender 4.5 LTS), numpy 1.26.4, Python 3.11.
# Source: source/blender/io/ply/exporter and source/blender/io/wavefront_obj/exporter, which has a flag for
#   mirrored transforms.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet bpy==4.5.15 numpy==1.26.4
env/bin/python - <<'PY'
from pathlib import Path

import bpy
import numpy as np


def volume(points: list[list[float]], triangles: list[list[int]]) -> float:
    """Return the volume inside, which is negative if the triangles face inward."""
    corners = np.array(points)[np.array(triangles)]
    return round(float(np.linalg.det(corners).sum() / 6), 6)


def words(path: str) -> list[list[str]]:
    """Return the words of each line."""
    return [line.split() for line in Path(path).read_text().splitlines() if line.strip()]


bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_cube_add(size=1)
bpy.context.object.scale = (-1, 1, 2)
bpy.ops.wm.ply_export(filepath="a.ply", ascii_format=True, export_triangulated_mesh=True)
bpy.ops.wm.obj_export(filepath="a.obj", export_triangulated_mesh=True)
bpy.ops.wm.stl_export(filepath="a.stl", ascii_format=True)

rows = words("a.ply")
rows = rows[rows.index(["end_header"]) + 1 :]
points = [[float(word) for word in row[:3]] for row in rows[:-12]]
found = {"ply": volume(points, [[int(word) for word in row[1:]] for row in rows[-12:]])}
points = [[float(word) for word in row[1:]] for row in words("a.obj") if row[0] == "v"]
faces = [row[1:] for row in words("a.obj") if row[0] == "f"]
found["obj"] = volume(points, [[int(word.split("/")[0]) - 1 for word in row] for row in faces])
points = [[float(word) for word in row[1:]] for row in words("a.stl") if row[0] == "vertex"]
found["stl"] = volume(points, np.arange(len(points)).reshape(-1, 3).tolist())
print(found)
assert found == {"ply": -2.0, "obj": 2.0, "stl": 2.0}
PY
