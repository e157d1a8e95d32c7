"""Does the boundary condition matter for matching? (thesis 5.5).

Each shape loses its part beyond a random plane. The piece is described by heat with a free boundary (Neumann), with a
fixed one (Dirichlet), and by their mean (reflection-free), and asked for among whole shapes. Nothing is tuned.
"""

import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.progress import track
from scipy.spatial import cKDTree

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, chart, finish, label, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, manifest, require_data  # noqa: E402

import eigenshape as es  # noqa: E402

CONDITIONS = ("Neumann", "Dirichlet", "reflection-free")
CLASSES = ("ant", "bird", "cup", "glasses", "hand", "human", "octopus", "teddy")
EACH, N_MODES = 3, 100
QUICK_CLASSES, QUICK_EACH, QUICK_MODES = ("glasses", "octopus"), 2, 30
KEPT = (0.5, 0.85)  # of the area, in the piece
NEAR = 0.1  # distance from the boundary, and of a point that is found, in √area of the whole
FLOOR = 1e-6  # of the mean heat; a few modes leave none in pockets that a fixed boundary cuts off
SHARES = np.geomspace(0.002, 0.05, 8)  # times, over the area of the whole
RECIPE = replace(es.retrieval.SCALE_FREE, name="of 100 modes", n_modes=N_MODES)


def cut(mesh: es.TriangleMesh, seed: int) -> tuple[es.TriangleMesh, np.ndarray]:
    """Return a piece that keeps a share of the area within `KEPT`, and its vertices in the whole."""
    rng = np.random.default_rng(seed)
    area = es.geometry.surface_area(mesh)
    while True:
        planes = es.scans.random_planes(mesh, rng, n_planes=1, share=rng.uniform(0.15, 0.5))
        cut_off = es.scans.cut_by_planes(mesh, planes)
        piece = es.repair(cut_off.mesh, ["largest_component"])
        if KEPT[0] <= es.geometry.surface_area(piece.mesh) / area <= KEPT[1]:
            return piece.mesh, cut_off.source_vertices[piece.source_vertices]


def spectra(mesh: es.TriangleMesh, k: int) -> tuple[es.Spectrum, es.Spectrum]:
    """Return the spectra with a free and with a fixed boundary; the same one where there is none."""
    laplacian = es.cotangent_laplacian(mesh)
    rim = es.geometry.boundary_vertices(mesh)
    free = es.solve_spectrum(laplacian, k)
    return free, es.solve_spectrum(laplacian, k, fixed=rim) if len(rim) else free


def heat(pair: tuple[es.Spectrum, es.Spectrum], condition: str, times: np.ndarray) -> np.ndarray:
    """Return the heat kernel signature with a condition at the boundary."""
    if condition == "reflection-free":
        found = es.spectral.reflection_free_signature(*pair, times)
    else:
        found = es.heat_kernel_signature(pair[CONDITIONS.index(condition)], times)
    return np.maximum(found, FLOOR / pair[0].mass.sum())


def describe(
    mesh: es.TriangleMesh, pair: tuple[es.Spectrum, es.Spectrum], condition: str
) -> es.retrieval.HeatDescriptor:
    """Return the heat of 15 persistent maxima, by the scale-free recipe of the library."""
    unit = RECIPE.time_unit * es.geometry.surface_area(mesh)
    early = heat(pair, condition, np.array([RECIPE.feature_scale * unit]))[:, 0]
    features = es.segment(es.merge_tree(mesh, early), n_regions=RECIPE.n_features).features
    inside = np.setdiff1d(features.vertices, es.geometry.boundary_vertices(mesh))
    kept = inside if condition == "Dirichlet" else features.vertices  # no heat where it is fixed
    times = unit * np.array(RECIPE.scales)
    vectors = np.log(heat(pair, condition, times)[kept] * es.geometry.surface_area(mesh))
    return es.retrieval.HeatDescriptor(vectors, kept, RECIPE)


def point_figures(
    meshes: tuple[es.TriangleMesh, es.TriangleMesh],
    source: np.ndarray,
    pairs: tuple[tuple[es.Spectrum, es.Spectrum], tuple[es.Spectrum, es.Spectrum]],
    condition: str,
) -> dict[str, float]:
    """Compare the signature of each point of the piece with that of the same point of the whole."""
    whole, piece = meshes
    area = es.geometry.surface_area(whole)
    old = heat(pairs[0], "Neumann", SHARES * area)
    new = heat(pairs[1], condition, SHARES * area)
    rim = es.geometry.boundary_vertices(piece)
    inside = np.setdiff1d(np.arange(piece.n_vertices), rim)
    logs, wanted = np.log(new[inside]), np.log(old)
    places = source[inside]
    away = cKDTree(piece.vertices[rim]).query(piece.vertices[inside])[0]
    change = np.abs(logs - wanted[places]).mean(axis=1)
    near = away < NEAR * area**0.5
    found = cKDTree(wanted).query(logs)[1]
    missed = np.linalg.norm(whole.vertices[found] - whole.vertices[places], axis=1)
    return {
        "change near": np.median(change[near]),
        "change elsewhere": np.median(change[~near]),
        "found": 100 * np.mean(missed < NEAR * area**0.5),
    }


def measure(classes: tuple[str, ...], each: int, k: int) -> dict[str, dict[str, float]]:
    """Return what each condition gives: changes and matches of points, and ranks of the right class."""
    rows = [row for row in manifest() if row["cls"] in classes]
    chosen = [row for name in classes for row in [r for r in rows if r["cls"] == name][:each]]
    labels = [row["cls"] for row in chosen]
    database, queries, points = (
        [],
        {name: [] for name in CONDITIONS},
        {name: [] for name in CONDITIONS},
    )
    for number, row in enumerate(track(chosen, description="shapes")):
        whole = es.geometry.normalize_mesh(es.read_mesh(DATA / row["path"]), "box")
        piece, source = cut(whole, number)
        before, after = spectra(whole, k), spectra(piece, k)
        database.append(describe(whole, before, "Neumann"))
        for name in CONDITIONS:
            queries[name].append(describe(piece, after, name))
            points[name].append(point_figures((whole, piece), source, (before, after), name))
    table = {}
    for name in CONDITIONS:
        ranks = [first_rank(queries[name][i], database, labels, i) for i in range(len(chosen))]
        table[name] = {
            key: float(np.mean([figures[key] for figures in points[name]]))
            for key in points[name][0]
        }
        for top in (1, 3, 5):
            table[name][f"top {top}"] = 100 * float(np.mean(np.array(ranks) <= top))
    return table


def first_rank(
    query: es.retrieval.HeatDescriptor,
    database: list[es.retrieval.HeatDescriptor],
    labels: list[str],
    own: int,
) -> int:
    """Return the rank of the nearest shape of the right class, the query's own whole left out."""
    scores = np.array([es.retrieval.matching_score(query, other) for other in database])
    order = [place for place in np.argsort(scores, kind="stable") if place != own]
    return 1 + next(r for r, place in enumerate(order) if labels[place] == labels[own])


def figure_conditions(table: dict[str, dict[str, float]]) -> Figure:
    """Draw how signatures change, and how often points and classes are found."""
    figure, (left, right) = chart(9.5, 3.9, columns=2)
    for place, (name, color) in enumerate(zip(CONDITIONS, COLORS, strict=False)):
        row = table[name]
        for axes, keys in (
            (left, ("change near", "change elsewhere")),
            (right, ("found", "top 1", "top 3", "top 5")),
        ):
            at = np.arange(len(keys)) + 0.27 * (place - 1)
            axes.bar(at, [row[key] for key in keys], 0.25, color=color, label=name)
            axes.set_xticks(range(len(keys)), keys)
    left.set_xticks((0, 1), ("within 0.1 √area of the boundary", "elsewhere"))
    label(left, "", "median of mean |log h' - log h|", "heat of a piece beside that of the whole")
    right.set_xticks(range(4), ("points found", "class first", "among 3", "among 5"))
    label(right, "", "%", "what a piece finds in whole shapes", legend=False)
    return figure


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    require_data()
    warnings.simplefilter("ignore")
    sizes = (
        (QUICK_CLASSES, QUICK_EACH, QUICK_MODES) if arguments.quick else (CLASSES, EACH, N_MODES)
    )
    table = measure(*sizes)
    pictures = {} if arguments.quick else {"conditions": figure_conditions(table)}
    finish(rounded(table), pictures, arguments)


if __name__ == "__main__":
    main()
