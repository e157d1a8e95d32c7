"""What errors of landmarks do to statistics, if they are drawn: independent ones, and ones that neighbors share.

It needs no collection: errors are added to the landmarks of the expert on the reporting strains.
"""

import sys
from pathlib import Path

import numpy as np
from run import statistics, strains, truth

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of
from real_shapes import require_data

# Roots of mean squares in mm: those of a mean of 0.141, about the noise of the labels, and of the
# errors of carried landmarks in expected.json (seven labelled skulls, one)
SIZES = 0.153, 0.196, 0.24
WIDTHS = 0.0, 1.0, 2.0, 4.0, 8.0  # mm, up to about which errors agree; 0: independent
N_DRAWS = 20


def drawn_errors(
    points: np.ndarray, size: float, width: float, draw: np.random.Generator
) -> np.ndarray:
    """Draw errors of some specimens' landmarks: Gaussian, with a Gaussian covariance in space."""
    middles = points.mean(axis=0)
    gaps = np.linalg.norm(middles[:, None] - middles, axis=2)
    covariance = np.exp(-((gaps / width) ** 2) / 2) if width else np.eye(len(middles))
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0))
    return size / np.sqrt(3) * root @ draw.standard_normal(points.shape)


def main() -> None:
    """Compare statistics of the expert's landmarks with those after errors are added."""
    arguments = options_of(__doc__, quick="two draws of each").parse_args()
    require_data()
    names = strains("reporting")
    given = [truth(name).points for name in names]
    # The files are nearly in one frame, in which neighbors are found.
    points = np.array(given)
    draw = np.random.default_rng(0)
    n_draws = 2 if arguments.quick else N_DRAWS
    found = {}
    for size in SIZES:
        for width in WIDTHS:
            draws = [
                statistics(points + drawn_errors(points, size, width, draw), names)
                for _ in range(n_draws)
            ]
            found[f"{size} mm, {width} mm"] = {
                key: float(np.mean([each[key] for each in draws])) for key in draws[0]
            } | {"low": float(np.quantile([each["Procrustes distances"] for each in draws], 0.05))}
    give_out({"quick" if arguments.quick else "full": rounded(found)}, arguments.out)


if __name__ == "__main__":
    main()
