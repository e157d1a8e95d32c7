"""
Read a file, color it, write it
===============================

A mesh is read from any of some twenty formats, and written with colors or with values at its
vertices that other programs show.
"""

import tempfile
from pathlib import Path

import eigenshape as es

folder = Path(tempfile.mkdtemp())
bird = es.make_creature("bird", 1, n_vertices=2000)
es.write_mesh(bird, folder / "bird.obj")

# %%
# Read it again, as you would read a scan, and compute one number for each vertex.

mesh = es.read_mesh(folder / "bird.obj")
print(mesh.n_vertices, "vertices, closed:", es.geometry.is_closed(mesh))
thickness = -es.geometry.signed_distance(
    mesh, mesh.vertices - 0.05 * es.geometry.vertex_normals(mesh)
)

# %%
# Colors go into a PLY file. A picture of the same values is drawn for a page.

colors = es.plot.value_colors(thickness, "magma")
es.write_mesh(mesh, folder / "colored.ply", colors=colors)
es.figure_field(mesh, thickness, "depth 0.05 below the skin, length", color_map="magma")
