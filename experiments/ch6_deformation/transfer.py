"""Poses of one animal given to another by six landmarks and a functional map: horse to camel, cat to lion."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import give_out, options_of, output_folder
from real_shapes import DATA, require_data

import eigenshape as es

START, SCALES = 100, (10, 20, 40)  # modes solved for; modes that carry


@dataclass(frozen=True)
class Pair:
    """Two animals: files, and at each the nose, tip of tail, left and right fore foot, left and right hind foot."""

    source: str
    target: str
    poses: tuple[str, ...]
    landmarks: tuple[tuple[int, ...], tuple[int, ...]]


PAIRS = {
    "horse to camel": Pair(
        "retrieval/horse/sumner_horse-08.ply",
        "classics/camel.off",
        tuple(f"retrieval/horse/sumner_horse-{number}.ply" for number in ("01", "03", "05")),
        ((4560, 8299, 2103, 2769, 6528, 7535), (315, 512, 9073, 9494, 8801, 9212)),
    ),
    "cat to lion": Pair(
        "retrieval/cat/sumner_cat-reference.ply",
        "retrieval/lion/sumner_lion-reference.ply",
        tuple(f"retrieval/cat/sumner_cat-{number}.ply" for number in ("02", "05", "08")),
        ((4260, 7192, 1935, 2986, 5952, 6866), (1833, 4937, 894, 1378, 4275, 4648)),
    ),
}


def main() -> None:
    """Map, transfer, measure and draw."""
    parser = options_of(__doc__, quick=None, out="ch6-transfer.json")
    parser.add_argument("--folder", type=output_folder, default="ch6-pictures")
    chosen = parser.parse_args()
    require_data()
    give_out(
        {name: transferred(name, pair, chosen.folder) for name, pair in PAIRS.items()}, chosen.out
    )


def transferred(name: str, pair: Pair, folder: Path) -> dict[str, dict[str, float]]:
    """Give all poses of the source to the target, at several scales."""
    source, target = (es.read_mesh(DATA / path) for path in (pair.source, pair.target))
    spectra = [es.solve_spectrum(es.cotangent_laplacian(mesh), START) for mesh in (source, target)]
    mapping = es.spectral.refine_map(
        es.functional_map(*spectra, np.column_stack(pair.landmarks)), max(SCALES)
    )
    results, rows = (
        {},
        [
            {f"{name.split(maxsplit=1)[0]}": source},
            {f"{name.rsplit(maxsplit=1)[-1]}, as given": target},
        ],
    )
    for path in pair.poses:
        pose = es.read_mesh(DATA / path)
        rows[0][Path(path).stem] = pose
        for scale in SCALES:
            bent = es.deformation.transfer_deformation(source, pose, target, mapping, n_modes=scale)
            found = es.deformation.measure_distortion(target, bent)
            results[f"{Path(path).stem}, {scale} modes"] = {
                "edges": round(found.edge_error, 3),
                "least area": round(float(found.area_ratios.min()), 2),
                "flipped": len(found.flipped),
            }
        rows[1][f"as {Path(path).stem}"] = bent
    for row, which in zip(rows, ("source", "target"), strict=True):
        es.save_figure(es.plot.figure_poses(row), folder / f"{name.replace(' ', '_')}_{which}.png")
    return results


if __name__ == "__main__":
    main()
