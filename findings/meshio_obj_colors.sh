#!/usr/bin/env bash
# Guess: an OBJ file whose lines v have a color after the position gives points of shape (n, 3) and a field of
#   colors.
# Behavior: `points` has six columns, positions and colors side by side, and there is no field.
# Output: (3, 6) {}
# Matters: lengths, boxes and nearest points are those of a space of six dimensions, and no error says so.
# Versions: meshio 5.3.5, numpy 2.4.6, Python 3.11.
# Source: https://github.com/nschloe/meshio/pull/1312, which announces a field `obj:rgb`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet meshio==5.3.5 numpy==2.4.6
env/bin/python - <<'PY'
from pathlib import Path

import meshio

Path("colored.obj").write_text("""\
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 0 1 0 0 0 1
f 1 2 3
""")
mesh = meshio.read("colored.obj")
print(mesh.points.shape, mesh.point_data)
assert mesh.points.shape == (3, 6)
assert not mesh.point_data
PY
