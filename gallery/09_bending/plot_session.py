"""
Edit, undo, and do it again on a finer mesh
===========================================

A session keeps what was done. Edits are saved as JSON, and can be repeated on another resolution of
the same shape.
"""

import tempfile
from pathlib import Path

import eigenshape as es

octopus = es.make_creature("octopus", n_vertices=1500)
session = es.DeformationSession(es.rig_shape(octopus))
tips = es.geometry.farthest_points(octopus, 8)[0]
for tip in tips[1:4]:
    brush = es.deformation.BrushRegion(octopus.vertices[tip], 0.3)
    session.drag(brush, es.Translation([0.0, 0.5, 0.0]))  # a preview, in a millisecond
    session.commit()
three = session.mesh
session.undo()
session.redo()

# %%
# On four times as many triangles.

path = Path(tempfile.mkdtemp()) / "edits.json"
es.io.write_edits(session.edits, octopus, path)
edits = es.io.read_edits(path, octopus)
fine = es.geometry.subdivide(octopus)
again = es.deformation.replay(es.rig_shape(fine), edits, source=octopus).mesh
es.plot.figure_poses({"as made": octopus, "three arms lifted": three, "on a finer mesh": again})
