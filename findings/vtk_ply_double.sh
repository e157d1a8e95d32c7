#!/usr/bin/env bash
# Guess: `property double x` of a PLY file is read with the precision of the file, as vtkOBJReader reads text.
# Behavior: vtkPLYReader returns single precision, so coordinates of 4,000 km are multiples of 0.25 m.
#   vtkOBJReader returns double precision.
# Output: y of 4000000.654321: PLY float 4000000.75, OBJ double 4000000.654321
# Matters: scans in national coordinates get steps of 25 cm. PyVista and ParaView read PLY by this class.
# Versions: vtk 9.7.2, numpy 2.4.6, Python 3.11.
# Source: vtkPLYReader.cxx, which stores each vertex in a struct of three floats.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet vtk==9.7.2 numpy==2.4.6
env/bin/python - <<'PY'
from pathlib import Path

import vtk

Y = 4000000.654321
rows = [f"500000.5 {Y} 0\n", f"500001.5 {Y} 0\n", f"500000.5 {Y + 1} 0\n"]
Path("a.obj").write_text("".join("v " + row for row in rows) + "f 1 2 3\n")
axes = "".join(f"property double {axis}\n" for axis in "xyz")
lists = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
head = f"ply\nformat ascii 1.0\nelement vertex 3\n{axes}{lists}"
Path("a.ply").write_text(head + "".join(rows) + "3 0 1 2\n")

found = {}
for reader in (vtk.vtkPLYReader(file_name="a.ply"), vtk.vtkOBJReader(file_name="a.obj")):
    reader.Update()
    points = reader.GetOutput().GetPoints()
    found[reader.GetClassName()] = points.GetData().GetDataTypeAsString(), points.GetPoint(0)[1]
print(found)
assert found["vtkPLYReader"] == ("float", 4000000.75)
assert found["vtkOBJReader"] == ("double", Y)
PY
