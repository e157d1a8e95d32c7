"""The wholes once more by functional maps with known landmarks: pyFM, with ZoomOut.

Needs `pip install pyfmaps`. It is told seven true pairs of points, which `match_shapes` is not.
"""

import time

import numpy as np
from pairs import REPORTING, Pair, draw_pairs, errors, make_pair
from run import COUNTS, SEEDS

import eigenshape as es

N_LANDMARKS = 7
N_FIRST, N_STEPS, STEP = 35, 23, 5  # eigenfunctions at first, and how ZoomOut adds to them: to 150


def known_pairs(pair: Pair) -> np.ndarray:
    """Return pairs of vertices (whole, part) that lie far from each other on the part."""
    rows = es.geometry.geodesic_distances(pair.part, pair.vertices)[:, pair.vertices]
    chosen = [int(rows.mean(axis=1).argmax())]
    while len(chosen) < N_LANDMARKS:
        chosen.append(int(rows[chosen].min(axis=0).argmax()))
    nearest = np.linalg.norm(pair.points[chosen][:, None] - pair.whole.vertices, axis=2)
    return np.column_stack([nearest.argmin(axis=1), pair.vertices[chosen]])


def functional_map(pair: Pair, landmarks: np.ndarray) -> np.ndarray:
    """Return the vertex of the whole for each vertex of the part."""
    from pyFM.functional import FunctionalMapping  # noqa: PLC0415 - needed here only
    from pyFM.mesh import TriMesh  # noqa: PLC0415

    meshes = [TriMesh(np.array(m.vertices), np.array(m.faces)) for m in (pair.whole, pair.part)]
    model = FunctionalMapping(*meshes)
    model.preprocess(landmarks=landmarks)
    model.fit(K=(N_FIRST, N_FIRST))
    model.zoomout_refine(nit=N_STEPS, step=STEP)
    return np.asarray(model.get_p2p())


def main() -> None:
    """Print the errors of each pair, without and with landmarks."""
    drawn = draw_pairs(REPORTING, "wholes", COUNTS["wholes"], first_seed=SEEDS["lion"])
    rows = []
    for wanted in drawn:
        pair = make_pair(*wanted)
        ours = es.match_shapes(pair.part, pair.whole).pull(pair.whole.vertices)
        begin = time.process_time()
        found = functional_map(pair, known_pairs(pair))
        seconds = time.process_time() - begin
        one, two = errors(pair, ours), errors(pair, pair.whole.vertices[found])
        rows.append((one.mean(), np.median(one), two.mean(), np.median(two), seconds))
        print(pair.name, np.round(rows[-1], 1))
    print("match_shapes: mean, median; with landmarks: mean, median, seconds")
    print(np.mean(rows, axis=0).round(2))


if __name__ == "__main__":
    main()
