"""How well automatic parts agree with those that people see: Rand index over labeled shapes.

What is done is kept in a folder, so that a stopped run goes on where it was.
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from rich.progress import track
from scipy.sparse.csgraph import connected_components
from sklearn.cluster import KMeans
from sklearn.manifold import spectral_embedding

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import give_out, options_of, output_folder
from real_shapes import DATA, first_members, labeled_shapes, require_data

QUICK = ("ant", "armadillo", "human", "table", "teddy")
N_TUNED = 5  # first members of each class: constants were chosen on them
COUNTS = (
    4,
    6,
    8,
    10,
)  # clusters tried for the baselines, of which the best on the tuning half is shown
N_COORDINATES = 8
DEFAULT = "default"

Labels = np.ndarray


def shapes(quick: bool) -> list[tuple[str, str, Path]]:
    """List name, class and file of the labeled shapes by class and number, or two of each of some classes."""
    labeled = labeled_shapes()
    if quick:
        members = {cls: [one for one in labeled if one[1] == cls] for cls in QUICK}
        labeled = [one for cls in QUICK for one in (members[cls][0], members[cls][-1])]
    return labeled


def face_neighbors(mesh: es.TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of faces at an edge, and the edge."""
    table = es.geometry.edge_table(mesh)
    order = np.argsort(table.face_edges.ravel(), kind="stable")
    edges = table.face_edges.ravel()[order]
    same = np.flatnonzero(edges[1:] == edges[:-1])
    return np.column_stack([order[same], order[same + 1]]) // 3, edges[same]


def pieces(mesh: es.TriangleMesh, labels: Labels) -> Labels:
    """Tell apart the connected pieces of one label: two legs have one label, and are two parts."""
    pairs, _ = face_neighbors(mesh)
    ends = pairs[labels[pairs[:, 0]] == labels[pairs[:, 1]]].T
    graph = sp.coo_array((np.ones(ends.shape[1], dtype=np.int8), ends), shape=(len(labels),) * 2)
    return connected_components(graph, directed=False)[1]


def rand_error(one: Labels, two: Labels) -> float:
    """Return the share of pairs of faces that are together in one and apart in the other: 1 - Rand index."""
    table = sp.coo_array((np.ones(len(one)), (one, two))).tocsr()
    table.sum_duplicates()
    alone = sum(
        (counts**2).sum()
        for counts in (np.bincount(one).astype(float), np.bincount(two).astype(float))
    )
    return float((alone - 2 * (table.data**2).sum()) / (len(one) * (len(one) - 1.0)))


def clustered(coordinates: np.ndarray, count: int) -> Labels:
    """Cluster faces by k-means; a quarter of them is enough to find the centers."""
    centers = KMeans(count, n_init=3, random_state=0).fit(coordinates[::4])
    return centers.predict(coordinates)


def spectral_coordinates(mesh: es.TriangleMesh) -> np.ndarray:
    """Return the embedding φ_i / √λ_i of the cotangent Laplacian at the faces (Rustamov 2007)."""
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), N_COORDINATES + 1)
    embedded = spectrum.eigenvectors[:, 1:] / np.sqrt(spectrum.eigenvalues[1:])
    return embedded[mesh.faces].mean(axis=1)


def cut_affinity(mesh: es.TriangleMesh) -> sp.csr_array:
    """Return how strongly faces hang together: edge length / (1 + bend / mean bend), convex bends a fifth."""
    pairs, edges = face_neighbors(mesh)
    normals, centers = es.geometry.face_normals(mesh), mesh.vertices[mesh.faces].mean(axis=1)
    one, two = normals[pairs[:, 0]], normals[pairs[:, 1]]
    concave = np.einsum("pi,pi->p", two - one, centers[pairs[:, 1]] - centers[pairs[:, 0]]) < 0
    bend = np.where(concave, 1.0, 0.2) * (1 - np.einsum("pi,pi->p", one, two))
    lengths = es.geometry.edge_lengths(mesh)[edges]
    weights = lengths / lengths.mean() / (1 + bend / bend.mean())
    both = np.concatenate([pairs, pairs[:, ::-1]]).T
    return sp.coo_array((np.tile(weights, 2), both), shape=(mesh.n_faces,) * 2).tocsr()


def normalized_cut_coordinates(mesh: es.TriangleMesh) -> np.ndarray:
    """Return the embedding in which scikit-learn's spectral clustering finds its clusters (Shi and Malik 2000)."""
    affinity = sp.csr_matrix(cut_affinity(mesh))
    return spectral_embedding(
        affinity, n_components=max(COUNTS), drop_first=False, eigen_solver="arpack", random_state=0
    )


def segmentations(mesh: es.TriangleMesh) -> dict[str, Callable[[], Labels]]:
    """Name all ways to find parts; each is computed when asked for."""
    found = es.find_parts(mesh)
    count = len(found.parts.features.vertices)
    ways: dict[str, Callable[[], Labels]] = {
        DEFAULT: lambda: found.parts.labels,
        "default, boundaries not smoothed": lambda: (
            es.segment(found.tree, persistence=es.features.PART_CONTRAST).labels
        ),
        "heat, scale-free preset": lambda: es.retrieval.find_heat_features(mesh).parts.labels,
        "thesis preset": lambda: (
            es.retrieval.find_heat_features(mesh, es.retrieval.THESIS).parts.labels
        ),
    }
    for name, coordinates in (
        ("k-means", spectral_coordinates),
        ("normalized cut", normalized_cut_coordinates),
    ):
        place = coordinates(mesh)
        for clusters in COUNTS:
            width = clusters if name == "normalized cut" else N_COORDINATES
            ways[f"{name}, {clusters}"] = lambda place=place, k=clusters, w=width: clustered(
                place[:, :w], k
            )
        ways[f"{name}, as many as the default"] = lambda place=place: clustered(
            place[:, :N_COORDINATES], count
        )
    return ways


def measure(name: str, path: Path) -> dict[str, dict[str, float]]:
    """Find parts in all ways: 1 - Rand index, number of parts, share of faces of the largest."""
    mesh = es.read_mesh(path)
    truth = pieces(mesh, np.load(DATA / "parts" / f"{name}.npy").astype(np.int64))
    rows = {}
    for way, find in segmentations(mesh).items():
        labels = find()
        sizes = np.bincount(labels)
        rows[way] = {
            "error": rand_error(truth, labels),
            "parts": int(np.count_nonzero(sizes)),
            "largest": float(sizes.max() / sizes.sum()),
        }
    return rows


def kept(folder: Path, name: str, path: Path) -> dict[str, dict[str, float]]:
    """Measure a shape, or read what was measured before."""
    file = folder / f"{name}.json"
    if not file.exists():
        file.write_text(json.dumps(measure(name, path)))
    return json.loads(file.read_text())


def summary(rows: dict[str, dict[str, dict[str, float]]], tuning: set[str]) -> dict[str, object]:
    """Average over halves and classes; of each baseline the number of clusters that is best on the tuning half."""
    halves = {
        "tuning": [n for n in rows if n in tuning],
        "reporting": [n for n in rows if n not in tuning],
    }
    halves["all"] = list(rows)
    ways = list(next(iter(rows.values())))

    def mean(way: str, names: list[str], what: str = "error") -> float:
        return float(np.mean([rows[name][way][what] for name in names]))

    shown = [way for way in ways if not way.split(", ")[-1].isdigit()]
    for baseline in ("k-means", "normalized cut"):
        shown.append(
            min(
                (f"{baseline}, {count}" for count in COUNTS),
                key=lambda way: mean(way, halves["tuning"]),
            )
        )
    classes = sorted({name.split("-")[0] for name in rows})
    return {
        "error": {
            way: {half: round(mean(way, names), 4) for half, names in halves.items()}
            for way in shown
        },
        "parts": {way: round(mean(way, halves["all"], "parts"), 1) for way in shown},
        "by class": {
            cls: {
                way: round(mean(way, [n for n in rows if n.startswith(f"{cls}-")]), 3)
                for way in shown
            }
            for cls in classes
        },
        "largest part of the default, median": {
            cls: round(
                float(
                    np.median(
                        [rows[n][DEFAULT]["largest"] for n in rows if n.startswith(f"{cls}-")]
                    )
                ),
                2,
            )
            for cls in classes
        },
    }


def main() -> None:
    """Measure every shape, print and save the table."""
    parser = options_of(
        __doc__, quick=f"two members of the classes {', '.join(QUICK)}", out="ch5-parts.json"
    )
    parser.add_argument(
        "--db", type=output_folder, default="ch5-parts", help="folder of what is done, kept"
    )
    arguments = parser.parse_args()
    require_data()
    wanted = shapes(arguments.quick)
    rows = {name: kept(arguments.db, name, path) for name, _, path in track(wanted, "shapes")}
    give_out(summary(rows, first_members(N_TUNED)), arguments.out)


if __name__ == "__main__":
    main()
