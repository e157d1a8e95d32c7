"""The main road in ten lines: index a few shapes, then find the kin of a partial scan in another pose.

Made-up creatures stand in for a folder of scans; `read_mesh("scan.ply")` takes their place with real files.
"""

import tempfile
from pathlib import Path

import numpy as np

import eigenshape as es


def main(folder: Path) -> list[es.retrieval.Match]:
    """Index three poses of three creatures and query with what one viewpoint sees of a fourth pose."""
    index = es.ShapeIndex.create(folder / "creatures")
    for kind in ("biped", "octopus", "fish"):
        for pose in range(3):
            mesh = es.make_creature(kind, pose)
            spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), k=300)
            heat = es.heat_kernel_signature(spectrum, [0.004 * es.geometry.surface_area(mesh)])
            parts = es.segment(es.merge_tree(mesh, heat[:, 0]), n_regions=15)
            views = es.retrieval.describe_views(
                mesh
            )  # what single viewpoints see, so that a scan meets its like
            index.add(f"{kind}-{pose}", [es.describe(spectrum, parts.features), *views], label=kind)

    scan = es.partial_scan(es.make_creature("octopus", 7), np.random.default_rng(1)).mesh
    return index.query(es.retrieval.describe_mesh(scan).descriptor, n_matches=3)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        for match in main(Path(temporary)):
            print(
                f"{match.name:12} {match.score:8.3f}  {len(match.correspondences)} corresponding features"
            )
