"""Parts of a surface as rooms between which heat flows badly, merged in the order in which it evens them out."""

from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import frozen, positive_values
from eigenshape._errors import InvalidParameterError
from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.part_hierarchy import PartTree
from eigenshape.features.segmentation import Segmentation, segment, touching_parts
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import vertex_components
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.spectrum import Spectrum

SEED_TIME = 1e-3  # of the area: heat so early has a maximum at every tip and bump
PART_TIME = 0.1  # of the area: after it, what is no part by itself has come to one temperature
N_SEEDS = 150  # basins to merge at most, and one for each further component: less is not called a part by anybody


def part_tree(mesh: MeshLike, spectrum: Spectrum, *, time: float = PART_TIME) -> PartTree:
    """Merge the basins of heat maxima, those first between which least of a difference in temperature is left.

    Parts R and S of areas |R|, |S| that touch are given the unit function u, constant on each, of mean 0. Of its energy

        ‖e^{-tL} u‖² = |R||S| / (|R| + |S|) · Σ_i e^{-2tλ_i} (mean of φ_i over R - mean over S)²

    is left after the time t. That is the price of merging them, between 0 and 1: low if one of them is small, for it
    cools or warms at once, and high if the passage between them is narrow or conducts badly. It is also what Ward's
    clustering (1963) of the faces loses in the embedding e^{-tλ} φ. The cheapest pair is merged first.

    Parameters
    ----------
    mesh : MeshLike
    spectrum : Spectrum
        Of the mesh, any Laplacian: that of `part_spectrum` conducts badly across concave creases.
    time : float
        The time t as a share of the area.

    Returns
    -------
    PartTree

    Raises
    ------
    InvalidParameterError
        If the spectrum is of another shape or does not begin with the lowest eigenvalue, or the time is not positive.
    """
    mesh = as_mesh(mesh)
    require_type(spectrum, Spectrum, "spectrum")
    (share,) = positive_values(time, "time")
    if len(spectrum.eigenvectors) != mesh.n_vertices:
        raise InvalidParameterError(
            f"spectrum must be of the mesh; it has {len(spectrum.eigenvectors)} points for {mesh.n_vertices} vertices."
        )
    area = float(spectrum.mass.sum())
    heat = heat_kernel_signature(spectrum, [SEED_TIME * area])[:, 0]
    n_components, _ = vertex_components(mesh)
    seeds = segment(merge_tree(mesh, heat), n_regions=N_SEEDS + n_components - 1)
    coordinates = spectrum.eigenvectors * np.exp(-share * area * spectrum.eigenvalues)
    return _gather(seeds, _merged(_rooms(mesh, seeds, coordinates), seeds.features.values))


@dataclass(frozen=True, eq=False)
class _Rooms:
    """Area and mean coordinates of each seed's region, in shares of the whole, and which regions touch."""

    areas: Float[np.ndarray, " r"]
    means: Float[np.ndarray, "r k"]
    touching: Int[np.ndarray, "p 2"]


def _rooms(
    mesh: TriangleMesh, seeds: Segmentation, coordinates: Float[np.ndarray, "n k"]
) -> _Rooms:
    count, areas = len(seeds.features.vertices), face_areas(mesh)
    weights = areas / areas.sum()
    region_areas = np.bincount(seeds.labels, weights=weights, minlength=count)
    corners = np.repeat(weights / 3, 3)
    sums = [
        np.bincount(
            np.repeat(seeds.labels, 3),
            weights=corners * column[mesh.faces.ravel()],
            minlength=count,
        )
        for column in coordinates.T
    ]
    means = np.column_stack(sums) * areas.sum() ** 0.5 / region_areas[:, None]
    return _Rooms(region_areas, means, touching_parts(mesh, seeds.labels))


def _merged(rooms: _Rooms, heights: Float[np.ndarray, " r"]) -> list[tuple[int, int, float]]:
    """Merge the cheapest pair again and again: of each, the region that ends, the one it ends in, and the price."""
    areas, means = rooms.areas.copy(), rooms.means.copy()
    beside: list[set[int]] = [set() for _ in areas]
    for one, two in rooms.touching.tolist():
        beside[one].add(two)
        beside[two].add(one)
    age = np.zeros(
        len(areas), dtype=np.int64
    )  # how often a region has grown: older prices of it are void

    def priced(one: int, two: int) -> tuple[float, int, int, int, int]:
        weight = areas[one] * areas[two] / (areas[one] + areas[two])
        price = float(weight * np.square(means[one] - means[two]).sum())
        return price, one, two, int(age[one]), int(age[two])

    waiting = [priced(one, two) for one, two in rooms.touching.tolist()]
    heapify(waiting)
    merges, highest = [], 0.0
    while waiting:
        price, one, two, age_one, age_two = heappop(waiting)
        if (age[one], age[two]) != (age_one, age_two):
            continue
        stays, ends = (one, two) if (heights[one], -one) > (heights[two], -two) else (two, one)
        highest = max(
            highest, price
        )  # a merge may make the next one cheaper; persistence never falls on the way
        merges.append((ends, stays, highest))
        total = areas[stays] + areas[ends]
        means[stays] = (areas[stays] * means[stays] + areas[ends] * means[ends]) / total
        areas[stays], age[stays], age[ends] = total, age[stays] + 1, -1
        beside[stays] = (beside[stays] | beside[ends]) - {stays, ends}
        for other in sorted(beside[stays]):
            beside[other] = (beside[other] - {ends}) | {stays}
            heappush(waiting, priced(stays, other))
    return merges


def _gather(seeds: Segmentation, merges: list[tuple[int, int, float]]) -> PartTree:
    """Sort the parts: those that never end by height, then by when they end, the last first."""
    count = len(seeds.features.vertices)
    parent, persistence = np.full(count, -1), np.full(count, np.inf)
    for ends, stays, price in merges:
        parent[ends], persistence[ends] = stays, price
    ended = np.array([ends for ends, _, _ in merges], dtype=np.int64)
    roots = np.flatnonzero(parent < 0)
    order = np.concatenate(
        [roots[np.argsort(-seeds.features.values[roots], kind="stable")], ended[::-1]]
    )
    number = np.empty(count, dtype=np.int64)
    number[order] = np.arange(count)
    return PartTree(
        maxima=frozen(seeds.features.vertices[order]),
        values=frozen(seeds.features.values[order]),
        persistence=frozen(persistence[order]),
        parent=frozen(np.where(parent[order] < 0, -1, number[parent[order]])),
        basins=frozen(number[seeds.labels]),
    )
