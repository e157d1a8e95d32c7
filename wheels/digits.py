"""What an installed wheel answers on a small shape, as JSON: the same script on two platforms compares their digits.

    python release/digits.py > here.json
    python release/digits.py --against here.json     the largest relative difference of each answer

The shape is rounded, so that platforms whose sines differ begin with the same coordinates.
"""

import argparse
import json
import platform
import sys
import tempfile
from pathlib import Path

import numpy as np
import scipy

import eigenshape as es

N_VERTICES = 500  # a minute where another processor is emulated
N_EIGENPAIRS = 20
DECIMALS = 6  # of coordinates
IN_INDEX = ("biped", "giraffe", "hand")


def make(kind: str, pose: int) -> es.TriangleMesh:
    """Return a creature with rounded coordinates."""
    creature = es.make_creature(kind, pose, n_vertices=N_VERTICES)
    return es.TriangleMesh(np.round(creature.vertices, DECIMALS), creature.faces)


def answers() -> dict[str, list[float]]:
    """Return the numbers of a spectrum, a merge tree, parts and a search by name."""
    biped = make("biped", 0)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(biped), k=N_EIGENPAIRS)
    tree = es.merge_tree(biped, (biped.vertices**2).sum(axis=1))  # limbs end at its maxima
    parts = es.find_parts(biped).parts
    with tempfile.TemporaryDirectory() as folder:
        index = es.ShapeIndex.create(Path(folder) / "index")
        for kind in IN_INDEX:
            index.add(kind, make(kind, 0), n_views=0)
        matches = index.query(make("biped", 1), n_matches=len(IN_INDEX))
    return {
        "coordinates": biped.vertices.ravel().tolist(),
        "certified eigenvalues": [spectrum.certificate.count, *spectrum.eigenvalues.tolist()],
        "merge tree": tree.persistence[np.isfinite(tree.persistence)].tolist(),
        "parts": parts.labels.tolist(),
        "matches": [IN_INDEX.index(match.name) for match in matches],
        "scores": [match.score for match in matches],
    }


def main() -> None:
    """Print the answers, or how far they are from those of another platform."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--against", type=Path, help="what another platform printed")
    options = parser.parse_args()
    found = answers()
    if options.against is None:
        versions = {"numpy": np.__version__, "scipy": scipy.__version__, "python": sys.version}
        print(json.dumps({"platform": platform.platform(), **versions, "answers": found}))
        return
    other = json.loads(options.against.read_text())["answers"]
    for name, values in found.items():
        one, two = np.array(values), np.array(other[name])
        largest = np.abs(one - two).max() / np.abs(two).max() if len(one) == len(two) else np.inf
        print(f"{name}: {'equal' if largest == 0 else f'{largest:.1e}'}")


if __name__ == "__main__":
    main()
