"""
Join scans from several sides
=============================

Frames of one rigid shape, each in a place of its own, are registered by patches that look alike, and
become one surface.
"""

import numpy as np

import eigenshape as es

fish = es.make_creature("fish", n_vertices=3000)
rng = np.random.default_rng(2)
frames = []
for degrees in (0, 40, 80):
    angle = np.deg2rad(degrees)
    seen = es.partial_scan(fish, [np.sin(angle), 0.2, np.cos(angle)]).mesh
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0] if frames else np.eye(3)
    turn *= np.linalg.det(turn)  # a rotation
    frames.append(es.TriangleMesh(seen.vertices @ turn + rng.standard_normal(3), seen.faces))
fused = es.matching.fuse_scans(frames)
print("joined:", fused.joined)

# %%
# What was made of them, in the place of the first one, and the three frames as they came.

panels = [
    es.plot.Panel(mesh, title, np.full(mesh.n_faces, -1), np.empty(0, dtype=int))
    for title, mesh in zip(
        ("joined", "from 0°", "from 40°", "from 80°"), (fused.mesh, *frames), strict=True
    )
]
es.plot.figure_contact_sheet(panels[0], panels[1:], view="left", up="y")
