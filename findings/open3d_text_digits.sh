#!/usr/bin/env bash
# Guess: a text PLY file with `property double`, an OBJ or OFF file keeps about the digits that the binary PLY
#   file keeps.
# Behavior: text is written with six significant digits, whatever the header says. In UTM coordinates, 4,000
#   km north, the only coordinates left are multiples of 10 m.
# Output: points move by 0 m in binary PLY, and by 3.25 m in text PLY, OBJ and OFF
# Matters: a scan in national coordinates is destroyed by saving it as OBJ; a box of 2 m becomes flat, without
#   a warning.
# Versions: open3d 0.20.0, numpy 2.4.6, Python 3.11.
# Source: default precision of C++ streams in cpp/open3d/io/file_format/FileOBJ.cpp and FilePLY.cpp.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet open3d==0.20.0 numpy==2.4.6
env/bin/python - <<'PY'
from pathlib import Path

import numpy as np
import open3d as o3d

box = o3d.geometry.TriangleMesh.create_box(1, 2, 3)
box.translate((500000.125, 4000001.25, 0.0))  # these digits are exact in binary
points = np.asarray(box.vertices)
moves = {}
for name, text in (("binary.ply", False), ("text.ply", True), ("a.obj", True), ("a.off", True)):
    o3d.io.write_triangle_mesh(name, box, write_ascii=text)
    read = np.asarray(o3d.io.read_triangle_mesh(name).vertices)
    # Readers of OBJ may order points anew, so each is compared with the nearest one.
    gaps = np.linalg.norm(points[:, None] - read, axis=2)
    moves[name] = float(gaps.min(axis=1).max())
print(moves)
assert "property double x" in Path("text.ply").read_text()
assert moves.pop("binary.ply") == 0.0
assert all(move > 1.0 for move in moves.values())
PY
