"""Find the kind of a noisy scan from one side, in a pose that the index has not seen, and which points correspond.

Synthetic creatures stand in for a folder of scans; with files, read each by `es.read_mesh("scan.ply")`.
"""

import tempfile
from pathlib import Path

import numpy as np

import eigenshape as es


def main(folder: Path, *, n_vertices: int = 2500) -> list[es.retrieval.Match]:
    """Index two poses of three creatures by patches, and ask for what one side of a third pose shows, with noise."""
    index = es.ShapeIndex.create(folder / "creatures")
    for kind in ("biped", "octopus", "fish"):
        for pose in range(2):
            mesh = es.make_creature(kind, pose, n_vertices=n_vertices)
            index.add(f"{kind}-{pose}", mesh, label=kind)

    rng = np.random.default_rng(1)
    seen = es.partial_scan(es.make_creature("octopus", 7, n_vertices=n_vertices), rng).mesh
    noise = 0.2 * es.geometry.edge_lengths(seen).mean() * rng.standard_normal(seen.vertices.shape)
    scan = es.TriangleMesh(seen.vertices + noise, seen.faces)
    return index.query(scan, n_matches=3)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        for match in main(Path(temporary)):
            print(
                f"{match.name:12} {match.score:8.3f}  {len(match.correspondences)} corresponding points"
            )
