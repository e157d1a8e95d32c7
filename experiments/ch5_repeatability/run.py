"""Do feature points come back in another pose, in a scan from one side, and on what planes leave? (thesis 5.2, 5.4).

Made creatures have exact maps between poses, parts have them to their wholes; between real poses, each remeshed by
itself, functional maps stand in.
"""

import sys
from collections import defaultdict
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np
from maps import map_between
from rich.progress import track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import give_out, options_of, output_folder
from real_shapes import DATA, inner_curvature, require_data

NEAR, N_FEATURES = 0.05, 15
KINDS, REAL = (
    ("biped", "giraffe", "hand", "quadruped"),
    ("human/tosca_david", "human/tosca_victoria", "cat/tosca_cat"),
)
N_POSES, N_VERTICES = 4, 3000
PICTURES = {"humans": ("human/tosca_michael", 3), "animals": ("cat/tosca_cat", 3)}


def by_heat(recipe: es.retrieval.HeatRecipe) -> object:
    """Return the features of a recipe as they are described."""
    return lambda mesh: es.retrieval.find_heat_features(mesh, recipe).parts


def by_values(function: object) -> object:
    """Return the most persistent maxima of a function of vertices."""
    return lambda mesh: es.segment(es.merge_tree(mesh, function(mesh)), n_regions=N_FEATURES)


FUNCTIONS = {
    "HKS, scale-free": by_heat(es.retrieval.SCALE_FREE),
    "HKS, thesis": by_heat(es.retrieval.THESIS),
    "AGD": by_values(es.geometry.average_geodesic_distance),
    "GC": by_values(inner_curvature),
}


@dataclass(frozen=True, eq=False)
class Part:
    """The features of a part by each function, and what it shows; both are vertices of the whole."""

    features: dict[str, np.ndarray]
    shown: np.ndarray


@dataclass(frozen=True, eq=False)
class Shape:
    """A mesh with the features of each function, and its parts."""

    mesh: es.TriangleMesh
    features: dict[str, np.ndarray]
    parts: dict[str, Part]


def found_on(mesh: es.TriangleMesh) -> dict[str, np.ndarray]:
    """Return the vertices of the features of all functions."""
    return {name: find(mesh).features.vertices[:N_FEATURES] for name, find in FUNCTIONS.items()}


def parts_of(mesh: es.TriangleMesh, seed: int) -> dict[str, es.scans.MeshPart]:
    """Return what one side shows, and what one or two planes leave in its largest piece."""
    rng = np.random.default_rng([5, seed])
    planes = es.scans.random_planes(mesh, rng, n_planes=int(rng.integers(1, 3)), share=0.2)
    cut = es.scans.cut_by_planes(mesh, planes)
    return {"partial": es.partial_scan(mesh, rng), "incomplete": largest_piece(cut)}


def largest_piece(part: es.scans.MeshPart) -> es.scans.MeshPart:
    """Keep the piece of most vertices: between pieces there are no distances."""
    _, labels = es.geometry.vertex_components(part.mesh)
    kept = np.flatnonzero(labels[part.mesh.faces[:, 0]] == np.bincount(labels).argmax())
    vertices, corners = np.unique(part.mesh.faces[kept], return_inverse=True)
    piece = es.TriangleMesh(part.mesh.vertices[vertices], corners.reshape(-1, 3))
    return es.scans.MeshPart(piece, part.source_vertices[vertices], part.source_faces[kept])


def shape_of(mesh: es.TriangleMesh, seed: int) -> Shape:
    """Find everything on a mesh and on its parts."""
    parts = {}
    for name, part in parts_of(mesh, seed).items():
        found = {
            key: part.source_vertices[vertices] for key, vertices in found_on(part.mesh).items()
        }
        parts[name] = Part(found, part.source_vertices)
    return Shape(mesh, found_on(mesh), parts)


def share_near(mesh: es.TriangleMesh, some: np.ndarray, others: np.ndarray) -> float:
    """Return the share of some vertices with one of the others within 5 % of √area along the surface."""
    distances = es.geometry.geodesic_distances(mesh, others)[:, some].min(axis=0)
    return float(np.mean(distances <= NEAR * np.sqrt(es.geometry.surface_area(mesh))))


def chance(mesh: es.TriangleMesh, features: np.ndarray) -> float:
    """Return the share of the area within 5 % of √area of a feature: what points at random would reach."""
    near = es.geometry.geodesic_distances(mesh, features).min(axis=0) <= NEAR * np.sqrt(
        es.geometry.surface_area(mesh)
    )
    areas = es.geometry.dual_volumes(mesh)
    return float(areas[near].sum() / areas.sum())


def measured(
    shapes: list[Shape], maps: dict[tuple[int, int], np.ndarray]
) -> dict[str, dict[str, list[float]]]:
    """Return all shares of one individual, by function: between poses, of its parts, and of points at random."""
    rows: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for name in FUNCTIONS:
        for (one, two), to in maps.items():
            there = to[shapes[one].features[name]]
            rows[name]["poses"].append(
                share_near(shapes[two].mesh, there, shapes[two].features[name])
            )
        for shape in shapes:
            for kind, part in shape.parts.items():
                rows[name][kind].append(
                    share_near(shape.mesh, part.features[name], shape.features[name])
                )
                shown = np.intersect1d(shape.features[name], part.shown)
                if len(shown):
                    rows[name][f"{kind}, kept"].append(
                        share_near(shape.mesh, shown, part.features[name])
                    )
            rows[name]["chance"].append(chance(shape.mesh, shape.features[name]))
            rows[name]["number"].append(len(shape.features[name]) / 100)
    return rows


def made(
    kind: str, n_poses: int, n_vertices: int
) -> tuple[list[Shape], dict[tuple[int, int], np.ndarray]]:
    """Return poses of a creature with their exact maps."""
    meshes = [es.make_creature(kind, pose, n_vertices=n_vertices) for pose in range(1, n_poses + 1)]
    same = np.arange(meshes[0].n_vertices)
    pairs = dict.fromkeys(permutations(range(n_poses), 2), same)
    return [shape_of(mesh, pose) for pose, mesh in enumerate(meshes)], pairs


def real(stem: str, n_poses: int) -> tuple[list[Shape], dict[tuple[int, int], np.ndarray]]:
    """Return poses of a TOSCA model with functional maps between them."""
    paths = sorted((DATA / "retrieval").glob(f"{stem}*.ply"))[:n_poses]
    shapes = [shape_of(es.read_mesh(path), pose) for pose, path in enumerate(paths)]
    pairs = permutations(range(len(shapes)), 2)
    return shapes, {
        (one, two): map_between(shapes[one].mesh, shapes[two].mesh) for one, two in pairs
    }


def quality_of_maps(kind: str, n_vertices: int) -> dict[str, float]:
    """Return how far functional maps between two poses are from the exact one, in √area."""
    one, two = (es.make_creature(kind, pose, n_vertices=n_vertices) for pose in (1, 2))
    to = map_between(one, two)
    some = np.arange(0, len(to), 25)
    off = np.array(
        [es.geometry.geodesic_distances(two, [vertex])[0, to[vertex]] for vertex in some]
    )
    off /= np.sqrt(es.geometry.surface_area(two))
    return {"median": float(np.median(off)), "within 5 %": float(np.mean(off <= NEAR))}


def table(rows: list[dict[str, dict[str, list[float]]]]) -> dict[str, dict[str, float]]:
    """Return the means over all individuals, in per cent; and how many features there are."""
    columns = (
        "poses",
        "partial",
        "partial, kept",
        "incomplete",
        "incomplete, kept",
        "chance",
        "number",
    )
    return {
        name: {
            key: round(100 * float(np.mean([x for row in rows for x in row[name][key]])), 1)
            for key in columns
        }
        for name in FUNCTIONS
    }


def upright(mesh: es.TriangleMesh) -> es.TriangleMesh:
    """Turn a shape of TOSCA, where z is up, so that y is."""
    return es.TriangleMesh(mesh.vertices[:, [1, 2, 0]], mesh.faces)


def picture(stem: str, n_poses: int) -> object:
    """Draw poses with a partial and an incomplete version; parts have the color of the feature that they answer."""
    paths = sorted((DATA / "retrieval").glob(f"{stem}*.ply"))[:n_poses]
    meshes = [upright(es.read_mesh(path)) for path in paths]
    find = FUNCTIONS["HKS, scale-free"]
    known = find(meshes[0])
    panels = [
        es.plot.Panel(
            meshes[0], f"{paths[0].stem}: 15 maxima", known.labels, known.features.vertices
        )
    ]
    for mesh, path in zip(meshes[1:], paths[1:], strict=True):
        panels.append(panel(mesh, path.stem, map_between(mesh, meshes[0]), (meshes[0], known)))
    for name, part in parts_of(meshes[0], 1).items():
        panels.append(
            panel(part.mesh, f"the first, {name}", part.source_vertices, (meshes[0], known))
        )
    return es.plot.figure_contact_sheet(
        panels[0], panels[1:], caption="gray: no partner within 5 % of √area"
    )


def panel(
    mesh: es.TriangleMesh, title: str, to: np.ndarray, reference: tuple[es.TriangleMesh, object]
) -> es.plot.Panel:
    """Color each part by the reference's feature nearest to its own, where one is near."""
    whole, known = reference
    parts = FUNCTIONS["HKS, scale-free"](mesh)
    distances = es.geometry.geodesic_distances(whole, known.features.vertices)[
        :, to[parts.features.vertices]
    ]
    near = distances.min(axis=0) <= NEAR * np.sqrt(es.geometry.surface_area(whole))
    colors = np.where(near, distances.argmin(axis=0), -1)
    return es.plot.Panel(
        mesh, f"{title}: {near.sum()} of {len(near)}", colors[parts.labels], parts.features.vertices
    )


def main() -> None:
    """Measure, print and save the tables, and draw."""
    parser = options_of(__doc__, quick="two poses of two small creatures")
    parser.add_argument(
        "--pictures", type=output_folder, help="folder for pictures after figure 5.2"
    )
    arguments = parser.parse_args()
    if not arguments.quick:
        require_data()
    kinds, size = (
        (("biped", "quadruped"), (2, 1500)) if arguments.quick else (KINDS, (N_POSES, N_VERTICES))
    )
    results = {
        "made": table([measured(*made(kind, *size)) for kind in track(kinds, "made creatures")])
    }
    if not arguments.quick:
        results["real"] = table(
            [measured(*real(stem, N_POSES)) for stem in track(REAL, "real shapes")]
        )
        results["maps"] = {kind: quality_of_maps(kind, N_VERTICES) for kind in KINDS}
    for name, (stem, n_poses) in PICTURES.items() if arguments.pictures else ():
        es.save_figure(picture(stem, n_poses), arguments.pictures / f"{name}.png")
    give_out(results, arguments.out)


if __name__ == "__main__":
    main()
