"""Part tree of a surface: its parts, merged in the order in which diffusion equalizes them."""

from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import freeze, positive_values
from eigenshape._errors import InvalidParameterError
from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.region_tree import PartTree, number_regions
from eigenshape.features.segmentation import Segmentation, adjacent_parts, segment
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import vertex_components
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.spectrum import Spectrum

# Heat time of the seeds, as a share of the area. Heat at so early a time has a maximum at every tip
# and bump. The best of 0.001, 0.003 and 0.01 on the tuning half of experiments/ch5_parts.
SEED_TIME = 1e-3
# Diffusion time of the merging price, as a share of the area. A longer time merges more. The best
# of 0.01 to 0.4 on the tuning half of experiments/ch5_parts.
PART_TIME = 0.1
# Largest number of basins to merge; one more for each further component. Basins beyond it are
# smaller than anything that people call a part; a larger number costs more merges.
N_SEEDS = 150


def part_tree(mesh: MeshLike, spectrum: Spectrum, *, time: float = PART_TIME) -> PartTree:
    """Compute the tree in which the parts of a surface merge.

    The basins of the maxima of early heat are merged, cheapest pair first. The price of a pair is
    the share of a temperature difference between the two that diffusion leaves after the given
    time. Let R and S be adjacent parts of areas |R| and |S|, and u the function of mean 0 and norm
    1 that is constant on each. The price is

        ‖e^{-tL} u‖² = |R||S| / (|R| + |S|) · Σ_i e^{-2tλ_i} (mean of φ_i over R - mean over S)²,

    between 0 and 1. It is low if one part is small, because a small part cools or warms at once,
    and high if the passage between them is narrow or conducts little heat. It is also the cost of a
    merge in Ward's clustering (1963) of the faces, embedded by e^{-tλ} φ.

    Parameters
    ----------
    mesh : MeshLike
    spectrum : Spectrum
        Spectrum of any Laplacian of the mesh. That of `part_spectrum` conducts little heat across
        concave creases.
    time : float
        The diffusion time t, as a share of the area.

    Returns
    -------
    PartTree

    Raises
    ------
    InvalidParameterError
        If the spectrum belongs to another shape or does not begin with the lowest eigenvalue, or if
        the time is not positive.

    See Also
    --------
    find_parts : Compute the spectrum and the tree, cut the tree, and smooth the boundaries.
    segment : Cut the tree.

    Examples
    --------
    Two separate spheres are two parts, each with infinite persistence:

    >>> import eigenshape as es
    >>> mesh = es.geometry.disjoint_union(es.icosphere(1), es.icosphere(2))
    >>> tree = es.features.part_tree(mesh, es.features.part_spectrum(mesh, n_modes=4))
    >>> es.segment(tree, persistence=1).features.persistence
    array([inf, inf])
    """
    mesh = as_mesh(mesh)
    require_type(spectrum, Spectrum, "spectrum")
    (share,) = positive_values(time, "time")
    if len(spectrum.eigenvectors) != mesh.n_vertices:
        raise InvalidParameterError(
            "spectrum must be of the mesh; "
            f"it has {len(spectrum.eigenvectors)} points for {mesh.n_vertices} vertices."
        )
    area = float(spectrum.mass.sum())
    heat = heat_kernel_signature(spectrum, [SEED_TIME * area])[:, 0]
    n_components, _ = vertex_components(mesh)
    seeds = segment(merge_tree(mesh, heat), n_regions=N_SEEDS + n_components - 1)
    coordinates = spectrum.eigenvectors * np.exp(-share * area * spectrum.eigenvalues)
    merges = _merge_cheapest(_measure_regions(mesh, seeds, coordinates), seeds.features.values)

    count = len(seeds.features.vertices)
    parent, persistence = np.full(count, -1), np.full(count, np.inf)
    for ends, remains, price in merges:
        parent[ends], persistence[ends] = remains, price
    # Regions that never end come first, by falling height; then the others, the last merge first.
    roots = np.flatnonzero(parent < 0)
    roots = roots[np.argsort(-seeds.features.values[roots], kind="stable")]
    ended = np.array([ends for ends, _, _ in merges], dtype=np.int64)
    order = np.concatenate([roots, ended[::-1]])
    parent, basins = number_regions(order, parent, seeds.labels)
    return PartTree(
        maxima=freeze(seeds.features.vertices[order]),
        values=freeze(seeds.features.values[order]),
        persistence=freeze(persistence[order]),
        parent=freeze(parent),
        basins=freeze(basins),
    )


@dataclass(frozen=True, eq=False)
class _Regions:
    """Area and mean coordinates of regions, for a surface of area 1, and the adjacent pairs."""

    areas: Float[np.ndarray, " r"]
    means: Float[np.ndarray, "r k"]
    adjacent: Int[np.ndarray, "p 2"]


def _measure_regions(
    mesh: TriangleMesh, seeds: Segmentation, coordinates: Float[np.ndarray, "n k"]
) -> _Regions:
    count, areas = len(seeds.features.vertices), face_areas(mesh)
    weights = areas / areas.sum()
    region_areas = np.bincount(seeds.labels, weights=weights, minlength=count)
    # The integral of a linear function over a face is a third of its area times the sum of the
    # corner values.
    corners = np.repeat(weights / 3, 3)
    corner_labels = np.repeat(seeds.labels, 3)
    sums = [
        np.bincount(corner_labels, weights=corners * column[mesh.faces.ravel()], minlength=count)
        for column in coordinates.T
    ]
    means = np.column_stack(sums) * areas.sum() ** 0.5 / region_areas[:, None]
    return _Regions(region_areas, means, adjacent_parts(mesh, seeds.labels))


def _merge_cheapest(
    regions: _Regions, heights: Float[np.ndarray, " r"]
) -> list[tuple[int, int, float]]:
    """Merge the cheapest pair until none is left.

    Returns
    -------
    list of (region that ends, region that absorbs it, price)
        In the order of the merges. Of two regions, the one with the lower maximum ends.
    """
    areas, means = regions.areas.copy(), regions.means.copy()
    neighbors: list[set[int]] = [set() for _ in areas]
    for one, two in regions.adjacent.tolist():
        neighbors[one].add(two)
        neighbors[two].add(one)
    # How often each region has grown. A price in the heap is void if either region has grown since.
    age = np.zeros(len(areas), dtype=np.int64)

    def price_pair(one: int, two: int) -> tuple[float, int, int, int, int]:
        weight = areas[one] * areas[two] / (areas[one] + areas[two])
        price = float(weight * np.square(means[one] - means[two]).sum())
        return price, one, two, int(age[one]), int(age[two])

    heap = [price_pair(one, two) for one, two in regions.adjacent.tolist()]
    heapify(heap)
    merges, highest = [], 0.0
    while heap:
        price, one, two, age_one, age_two = heappop(heap)
        if (age[one], age[two]) != (age_one, age_two):
            continue
        remains, ends = (one, two) if (heights[one], -one) > (heights[two], -two) else (two, one)
        # A merge may make the next one cheaper; the running maximum keeps persistence in the order
        # of the merges.
        highest = max(highest, price)
        merges.append((ends, remains, highest))
        total = areas[remains] + areas[ends]
        means[remains] = (areas[remains] * means[remains] + areas[ends] * means[ends]) / total
        areas[remains] = total
        age[remains] += 1
        age[ends] = -1
        neighbors[remains] = (neighbors[remains] | neighbors[ends]) - {remains, ends}
        for other in sorted(neighbors[remains]):
            neighbors[other] = (neighbors[other] - {ends}) | {remains}
            heappush(heap, price_pair(remains, other))
    return merges
