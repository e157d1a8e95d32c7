#!/usr/bin/env bash
# Guess: `TetMesh.write_vtk` writes tetrahedra as VTK has them: an unstructured grid with cells of type 10.
# Behavior: it writes surface data (POLYDATA) in which each tetrahedron is a polygon of four corners. VTK, and
#   so ParaView and PyVista, reads quads without volume.
# Output: vtkPolyData vtkQuad
# Matters: the file opens everywhere without an error, as a wrong surface; and a reader cannot tell tetrahedra
#   from quads, since the header is the same.
# Versions: lapy 1.7.0, vtk 9.7.2, numpy 2.4.6, Python 3.11.
# Source: TetMesh.write_vtk in lapy/tet_mesh.py; cell types in
#   https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet lapy==1.7.0 vtk==9.7.2 numpy==2.4.6
env/bin/python - <<'PY'
import numpy as np
import vtk
from lapy import TetMesh

points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TetMesh(points, np.array([[0, 1, 2, 3]])).write_vtk("solid.vtk")

reader = vtk.vtkGenericDataObjectReader()
reader.SetFileName("solid.vtk")
reader.Update()
data = reader.GetOutput()
print(data.GetClassName(), data.GetCell(0).GetClassName())
assert data.IsA("vtkPolyData")
assert data.GetCellType(0) == vtk.VTK_QUAD  # a tetrahedron would be vtk.VTK_TETRA
PY
