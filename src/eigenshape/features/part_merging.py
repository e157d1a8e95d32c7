"""Part tree of a surface: its parts, merged in the order in which diffusion equalizes them."""

from collections.abc import Callable
from functools import partial
from heapq import heapify, heappop, heappush

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_values
from certeig.kit.errors import InvalidParameterError
from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.region_tree import PartTree, number_regions
from eigenshape.features.segmentation import Segmentation, adjacent_parts, segment
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import vertex_components
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.spectrum import Spectrum

# The region that ends, the region that absorbs it, and the persistence of the former.
Merge = tuple[int, int, float]
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
        Spectrum of any Laplacian of the mesh. That of `find_parts(mesh).spectrum` conducts little
        heat across concave creases.
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
    >>> tree = es.features.part_tree(mesh, es.find_parts(mesh, n_modes=4).spectrum)
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
    areas, means = region_means(mesh, seeds.labels, heat_coordinates(spectrum, share))

    def price(one: int, two: int) -> float:
        weight = areas[one] * areas[two] / (areas[one] + areas[two])
        return float(weight * np.square(means[one] - means[two]).sum())

    join = partial(join_means, areas, means)
    adjacent = adjacent_parts(mesh, seeds.labels)
    return tree_of_merges(seeds, merge_cheapest(adjacent, seeds.features.values, price, join))


def heat_coordinates(spectrum: Spectrum, share: float) -> Float[np.ndarray, "n k"]:
    """Return e^{-tλ} φ at each vertex, with the time t as a share of the area."""
    area = float(spectrum.mass.sum())
    return np.asarray(spectrum.eigenvectors * np.exp(-share * area * spectrum.eigenvalues))


def tree_of_merges(seeds: Segmentation, merges: list[Merge]) -> PartTree:
    """Build the tree in which regions merge.

    Parameters
    ----------
    seeds : Segmentation
        The regions.
    merges : list of (region that ends, region that absorbs it, persistence)
        In the order of the merges, with rising persistence.
    """
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
        maxima=seeds.features.vertices[order],
        values=seeds.features.values[order],
        persistence=persistence[order],
        parent=parent,
        basins=basins,
    )


def region_means(
    mesh: TriangleMesh, labels: Int[np.ndarray, " f"], values: Float[np.ndarray, "n k"]
) -> tuple[Float[np.ndarray, " r"], Float[np.ndarray, "r k"]]:
    """Return areas of regions and means of functions over them, for a surface scaled to area 1."""
    count, areas = int(labels.max()) + 1, face_areas(mesh)
    weights = areas / areas.sum()
    region_areas = np.bincount(labels, weights=weights, minlength=count)
    # The integral of a linear function over a face is a third of its area times the sum of the
    # corner values.
    corners = np.repeat(weights / 3, 3), (np.repeat(labels, 3), mesh.faces.ravel())
    integrals = sp.coo_array(corners, shape=(count, mesh.n_vertices)).tocsr()
    return region_areas, integrals @ values * areas.sum() ** 0.5 / region_areas[:, None]


def join_means(
    areas: Float[np.ndarray, " r"], means: Float[np.ndarray, "r k"], remains: int, ends: int
) -> None:
    """Let one region take over the area and the mean of another, in place."""
    total = areas[remains] + areas[ends]
    means[remains] = (areas[remains] * means[remains] + areas[ends] * means[ends]) / total
    areas[remains] = total


def merge_cheapest(
    adjacent: Int[np.ndarray, "p 2"],
    heights: Float[np.ndarray, " r"],
    price: Callable[[int, int], float],
    join: Callable[[int, int], None],
    least: float = 0.0,
) -> list[Merge]:
    """Merge the cheapest pair of adjacent regions until none is left.

    Parameters
    ----------
    adjacent : (p, 2) int
    heights : (r,) float
        Of two regions, the one with the lower maximum ends.
    price : callable
        Price of merging two regions.
    join : callable
        Called as ``join(remains, ends)`` at each merge, to update what `price` reads.
    least : float
        Lower bound of the prices that are returned.

    Returns
    -------
    list of (region that ends, region that absorbs it, price)
        In the order of the merges. A merge may make the next one cheaper, so that the running
        maximum is returned: it keeps persistence in the order of the merges.
    """
    neighbors: list[set[int]] = [set() for _ in heights]
    for one, two in adjacent.tolist():
        neighbors[one].add(two)
        neighbors[two].add(one)
    # How often each region has grown. A price in the heap is void if either region has grown since.
    age = [0] * len(heights)
    heap = [(price(one, two), one, two, 0, 0) for one, two in adjacent.tolist()]
    heapify(heap)
    merges, highest = [], least
    while heap:
        cost, one, two, age_one, age_two = heappop(heap)
        if (age[one], age[two]) != (age_one, age_two):
            continue
        remains, ends = (one, two) if (heights[one], -one) > (heights[two], -two) else (two, one)
        highest = max(highest, cost)
        merges.append((ends, remains, highest))
        join(remains, ends)
        age[remains] += 1
        age[ends] = -1
        neighbors[remains] = (neighbors[remains] | neighbors[ends]) - {remains, ends}
        for other in sorted(neighbors[remains]):
            neighbors[other] = (neighbors[other] - {ends}) | {remains}
            heappush(heap, (price(remains, other), remains, other, age[remains], age[other]))
    return merges
