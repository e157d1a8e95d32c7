"""From meshes to matches: index a few shapes, then find those most like a partial scan in another pose.

Synthetic creatures stand in for a folder of scans; with files, read each by `es.read_mesh("scan.ply")`.
"""

import tempfile
from pathlib import Path

import numpy as np

import eigenshape as es


def main(folder: Path, *, n_vertices: int = 2500) -> list[es.retrieval.Match]:
    """Index three poses of three creatures, and query with what one viewpoint sees of a fourth pose."""
    index = es.ShapeIndex.create(folder / "creatures")
    for kind in ("biped", "octopus", "fish"):
        for pose in range(3):
            mesh = es.make_creature(kind, pose, n_vertices=n_vertices)
            index.add(f"{kind}-{pose}", mesh, recipe=es.retrieval.SCALE_FREE, label=kind)

    octopus = es.make_creature("octopus", 7, n_vertices=n_vertices)
    scan = es.partial_scan(octopus, np.random.default_rng(1)).mesh

    # The same steps by hand: spectrum, heat, and one part around each of its persistent maxima
    spectrum = es.solve_spectrum(es.cotangent_laplacian(scan), k=150)
    heat = es.heat_kernel_signature(spectrum, [0.004 * es.geometry.surface_area(scan)])
    parts = es.segment(es.merge_tree(scan, heat[:, 0]), n_regions=15)
    print(f"{scan.n_vertices} vertices, {len(parts.features.vertices)} parts")

    return index.query(scan, n_matches=3)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        for match in main(Path(temporary)):
            print(
                f"{match.name:12} {match.score:8.3f}  {len(match.correspondences)} corresponding features"
            )
