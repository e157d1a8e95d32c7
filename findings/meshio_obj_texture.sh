#!/usr/bin/env bash
# Guess: in `f 1/1 2/3 3/2` the second numbers say which texture coordinate belongs to which corner.
# Behavior: they are not read. The lines vt become a field of the points in the order of the file, so points
#   get the coordinates of others.
# Output: the point at x = 1 has texture coordinates [0. 1.]; the file says 1 0.
# Matters: most OBJ files with a texture number vt by themselves. If there are as many vt as v, the texture is
#   wrong without a word; otherwise the file is refused.
# Versions: meshio 5.3.5, numpy 2.4.6, Python 3.11.
# Source: the definition of f in http://paulbourke.net/dataformats/obj/; reader in meshio/obj/_obj.py.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet meshio==5.3.5 numpy==2.4.6
env/bin/python - <<'PY'
from pathlib import Path

import meshio

Path("textured.obj").write_text("""\
v 0 0 0
v 1 0 0
v 0 1 0
vt 0 0
vt 0 1
vt 1 0
f 1/1 2/3 3/2
""")
mesh = meshio.read("textured.obj")
texture = mesh.point_data["obj:vt"]
print("the point at x =", mesh.points[1, 0], "has texture coordinates", texture[1])
assert texture[1].tolist() == [0.0, 1.0]  # by the line f it is the third vt, 1 0
PY
