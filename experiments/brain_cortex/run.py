"""Are parcels of cortices alike on both sides, and on which scales do the sides differ.

Cortices of human, macaque and marmoset, left and right, from the wheel of neuromodes, where they are read. Vertices of
one number correspond, left to right.
"""

import sys
from pathlib import Path

import numpy as np
from neuromodes.io import fetch_example_surf
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, chart, finish, label, parse_arguments, rounded  # noqa: E402

import eigenshape as es  # noqa: E402

COUNTS = (10, 50, 100, 200, 400)  # of parcels
SPECIES = ("human", "macaque", "marmoset")


def read_sides(species: str, *, quick: bool) -> tuple[es.TriangleMesh, es.TriangleMesh]:
    """Return the left and the right cortex on the vertices that belong to both, without the medial wall."""
    density = "4k" if quick else "32k"
    sides = [fetch_example_surf(species, density, hemi) for hemi in "LR"]
    common = sides[0][1] & sides[1][1]
    faces = sides[0][0].t[common[sides[0][0].t].all(axis=1)]
    whole = es.TriangleMesh(sides[0][0].v, faces)
    left = es.repair(whole, ["drop_unreferenced", "largest_component"])
    right = es.TriangleMesh(sides[1][0].v[left.source_vertices], left.mesh.faces)
    return left.mesh, right


def measure_parcels(
    left: es.TriangleMesh, right: es.TriangleMesh, counts: list[int]
) -> dict[str, dict[str, float]]:
    """Return sizes and connectedness of parcels, and by how much of the area both sides agree."""
    trees = [
        es.modes.nodal_parcels(es.cotangent_laplacian(side), counts[-1]) for side in (left, right)
    ]
    graph = csr_array(es.operators.edge_graph(left))
    areas = es.geometry.dual_volumes(left)
    table = {}
    for count in counts:
        one, two = (tree.cut(count) for tree in trees)
        sizes = np.bincount(one, areas)
        pieces = [connected_components(graph[one == p][:, one == p])[0] for p in range(count)]
        # Parcels of both sides in the pairs that share most area.
        shared = np.zeros((count, count))
        np.add.at(shared, (one, two), areas)
        rows, columns = linear_sum_assignment(-shared)
        table[f"{count}"] = {
            "smallest": sizes.min() / sizes.mean(),
            "largest": sizes.max() / sizes.mean(),
            "in pieces": int(np.count_nonzero(np.array(pieces) > 1)),
            "agreement": shared[rows, columns].sum() / areas.sum(),
        }
    return table


def asymmetry(left: es.TriangleMesh, right: es.TriangleMesh) -> np.ndarray:
    """Return where the mirrored right side lies beside the left, after a similarity (Procrustes)."""
    weights = es.geometry.dual_volumes(left)[:, None]
    weights = weights / weights.sum()
    target = left.vertices - (weights * left.vertices).sum(axis=0)
    mirrored = right.vertices * [-1.0, 1.0, 1.0]
    mirrored = mirrored - (weights * mirrored).sum(axis=0)
    one, stretches, two = np.linalg.svd(mirrored.T @ (weights * target))
    scale = stretches.sum() / (weights * mirrored**2).sum()
    return scale * mirrored @ (one @ two) - target


def measure_asymmetry(left: es.TriangleMesh, right: es.TriangleMesh, k: int) -> dict[str, object]:
    """Return the size of the asymmetry, and its shares in groups of 3, 5, ... modes."""
    spectrum = es.solve_spectrum(es.cotangent_laplacian(left), k)
    field = asymmetry(left, right)
    areas = es.geometry.dual_volumes(left)
    total = areas @ (field**2).sum(axis=1)
    power = (es.spectral.project(field, spectrum) ** 2).sum(axis=1) / total
    return {
        "size": np.sqrt(total) / areas.sum(),  # root mean square, over the root of the area
        "share": {f"{j}": power[:j].sum() for j in (4, 16, 49, 100, 400) if j <= k},
        "groups": [power[d**2 : (d + 1) ** 2].sum() for d in range(1, int(k**0.5))],
    }


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    quick = arguments.quick
    species = SPECIES[:1] if quick else SPECIES
    parcels, sides = {}, {}
    for name in species:
        left, right = read_sides(name, quick=quick)
        parcels[name] = measure_parcels(left, right, list(COUNTS[:2] if quick else COUNTS))
        sides[name] = measure_asymmetry(left, right, 49 if quick else 400)
    figure, (axes,) = chart()
    for name, color in zip(species, COLORS, strict=False):
        groups = np.array(sides[name]["groups"])
        degrees = 1 + np.arange(len(groups))
        axes.loglog(degrees, groups / (2 * degrees + 1), color=color, label=name, marker=".")
    label(
        axes,
        "group of modes l, 2l + 1 modes each",
        "share of a mode",
        "asymmetry of cortices, mode by mode",
    )
    finish(rounded({"parcels": parcels, "sides": sides}), {"asymmetry": figure}, arguments)


if __name__ == "__main__":
    main()
