"""Bend a shape: turn a head, lift a foot, take it back, keep the edits, and do them again on a finer mesh.

A made-up giraffe stands in for a scan; `read_mesh("scan.ply")` takes its place with real files.
"""

import tempfile
from pathlib import Path

import numpy as np

import eigenshape as es


def main(folder: Path, *, n_vertices: int = 3000) -> dict[str, es.TriangleMesh]:
    """Edit a giraffe in a session, and replay the edits on a mesh with four times the faces."""
    giraffe = es.make_creature("giraffe", 1, n_vertices=n_vertices)
    low, high = giraffe.vertices.min(axis=0), giraffe.vertices.max(axis=0)
    head = es.deformation.BoxRegion(
        [-np.inf, low[1] + 0.8 * (high - low)[1], -np.inf], [np.inf] * 3
    )
    rim = es.deformation.region_boundary(giraffe, es.deformation.region_mask(giraffe, head))

    session = es.DeformationSession(es.rig_shape(giraffe))
    # As a hand would drag: each step shows the eigen-skeleton and costs a millisecond
    for degrees in (10, 20, 30):
        session.drag(
            head, es.Rotation(giraffe.vertices[rim].mean(axis=0), [1, 0, 0], np.deg2rad(degrees))
        )
    nodding = session.commit()

    foot = int(np.argmin(nodding.vertices @ [0.0, 1.0, -0.2]))
    session.drag(
        es.deformation.BrushRegion(nodding.vertices[foot], 0.15 * (high - low)[1]),
        es.Translation([0, 0.05, 0.05]),
    )
    lifted = session.commit()
    session.undo()
    session.redo()

    es.io.write_edits(session.edits, giraffe, folder / "edits.json")
    edits = es.io.read_edits(folder / "edits.json", giraffe)
    finer = es.rig_shape(es.geometry.subdivide(giraffe))
    again = es.deformation.replay(finer, edits, source=giraffe).mesh
    es.save_figure(
        es.plot.figure_poses({"as made": giraffe, "bent": lifted}, session_shares(giraffe, lifted)),
        folder / "giraffe.png",
    )
    return {"as made": giraffe, "nodding": nodding, "lifted": lifted, "again, finer": again}


def session_shares(before: es.TriangleMesh, after: es.TriangleMesh) -> np.ndarray:
    """Return how far each vertex went, over the farthest."""
    moved = np.linalg.norm(after.vertices - before.vertices, axis=1)
    return moved / moved.max()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        for name, mesh in main(Path(temporary)).items():
            print(
                f"{name:14} {mesh.n_vertices:6,} vertices, head at {mesh.vertices[:, 1].max():.3f}"
            )
