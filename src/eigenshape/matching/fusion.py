"""Join scans of one shape from several sides to one surface, and bend those in another pose."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress
from certeig.kit.threads import one_blas_thread
from eigenshape._corners import mean_normals
from eigenshape.deformation.deform import N_ROUNDS
from eigenshape.deformation.rigidity import edge_weights, free_part, relax
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import submesh, vertex_components
from eigenshape.matching.match import match_shapes
from eigenshape.matching.registration import (
    NO_MOTION,
    Registration,
    describe_scan,
    fit_motion,
    register_described,
)
from eigenshape.operators.cotangent import surface_laplacian
from eigenshape.scans.reconstruction import reconstruct_surface

# Least score of two scans that are joined. Of 50 pairs of frames of shapes that are not round, of the
# tuning half of experiments/ch5_retrieval, 17 of 19 above it were placed right, and 4 of 23 below.
LEAST_SCORE = 0.3


@record
class FusedScan(ReadOnly):
    """Several scans as one surface.

    Attributes
    ----------
    mesh : TriangleMesh
        The surface, placed as the first scan that was joined.
    joined : (k,) bool
        Which of the k scans were joined. The others overlap with none of these by enough.
    motions : tuple of k Registration
        The motion of each scan to its place; none for a scan that was not joined, or that was bent
        into the pose of the others.
    scores : (k, k) float
        Score of each pair of scans (`Registration`), symmetric; 1 on the diagonal.
    source_scans, source_vertices : (n,) int
        For each vertex of `mesh`, the scan that has the nearest vertex, and its number there.

    See Also
    --------
    fuse_scans, register_scans

    Examples
    --------
    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=3000)
    >>> sides = [es.partial_scan(fish, view).mesh for view in ([0, 0, 1], [0.8, 0, 1])]
    >>> fused = es.matching.fuse_scans(sides)
    >>> fused.joined
    array([ True,  True])
    """

    mesh: TriangleMesh
    joined: Bool[np.ndarray, " k"]
    motions: tuple[Registration | None, ...]
    scores: Float[np.ndarray, "k k"]
    source_scans: Int[np.ndarray, " n"]
    source_vertices: Int[np.ndarray, " n"]


@one_blas_thread()
def fuse_scans(
    scans: Sequence[MeshLike], *, bend: bool = True, progress: Progress | None = None
) -> FusedScan:
    """Join scans of one shape, such as depth scans, to one surface.

    Each two scans are registered (`register_scans`). The pairs with the best scores that connect
    most scans place them. A scan that no motion places may show the shape in another pose: the region
    that it shares with a placed scan is found (`match_shapes` with ``overlap="partial"``), laid on
    that scan, and the rest of the scan is bent along. A scan that shares no region is left out, and
    the others are joined; see `joined`. The surface that fits the points and normals of all is computed
    (`eigenshape.io.read_surface` makes surfaces of clouds in the same way). Where no scan saw the
    shape, the surface stays open.

    Parameters
    ----------
    scans : sequence of k MeshLike
        In one length unit, in any places. Neighbors should share a third of what they show: views
        that are 30 degrees apart do, on most shapes.
    bend : bool, optional
        Whether to bend scans that no motion places, which takes about 10 s for each pair that is tried.
        Pass False if the shape is rigid.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    FusedScan

    Raises
    ------
    InvalidParameterError
        If `scans` is no list, or empty.
    InvalidShapeError
        If a scan cannot be described (`extract_patches`), or no surface fits the points.

    See Also
    --------
    register_scans, simulate_scan, es.io.read_surface

    Examples
    --------
    Both sides of a fish, seen from in front and from the side:

    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=3000)
    >>> sides = [es.partial_scan(fish, view).mesh for view in ([0, 0, 1], [0.8, 0, 1])]
    >>> fused = es.matching.fuse_scans(sides)
    >>> areas = [es.geometry.surface_area(mesh) for mesh in (*sides, fused.mesh)]
    >>> areas[2] > max(areas[:2])
    True
    """
    meshes = _meshes_of(scans)
    k = len(meshes)
    pairs = list(combinations(range(k), 2))
    n_steps = k + len(pairs) + 1

    def tell(step: int, what: str) -> None:
        if progress is not None:
            progress(step / n_steps, what)

    described = []
    for number, mesh in enumerate(meshes):
        tell(number, "describing")
        described.append(describe_scan(mesh))
    found = {}
    for number, (one, two) in enumerate(pairs):
        tell(k + number, "registering")
        found[two, one] = register_described(described[two], described[one])
        found[one, two] = found[two, one].inverse()
    scores = np.eye(k)
    for (one, two), motion in found.items():
        scores[one, two] = motion.score

    motions = _placed(k, found)
    # Where each scan lies, and which of its vertices are used
    placed = {}
    for number, way in enumerate(motions):
        if way is not None:
            scan = described[number]
            mesh = TriangleMesh(way.move(scan.mesh.vertices + scan.middle), scan.mesh.faces)
            placed[number] = mesh, np.arange(mesh.n_vertices)
    # What no motion places is bent onto the first placed scan that shares a region with it. The
    # list grows while it is walked: a bent scan may place others.
    bases = list(placed) if bend else []
    for base in bases:
        for number in range(k):
            if number in placed:
                continue
            tell(n_steps - 1, f"bending scan {number} onto scan {base}")
            bent = _bend_onto(described[number].mesh, placed[base][0])
            if bent is not None:
                placed[number] = bent
                bases.append(number)

    tell(n_steps - 1, "joining")
    points = np.concatenate([mesh.vertices for mesh, _ in placed.values()])
    normals = np.concatenate([mean_normals(mesh) for mesh, _ in placed.values()])
    made = reconstruct_surface(PointCloud(points), normals)
    owners = np.repeat(list(placed), [len(numbers) for _, numbers in placed.values()])
    numbers = np.concatenate([numbers for _, numbers in placed.values()])
    joined = np.isin(np.arange(k), list(placed))
    tell(n_steps, "")
    return FusedScan(
        made.mesh,
        joined,
        motions,
        scores,
        owners[made.source_vertices],
        numbers[made.source_vertices],
    )


def _bend_onto(
    mesh: TriangleMesh, other: TriangleMesh
) -> tuple[TriangleMesh, Int[np.ndarray, " v"]] | None:
    """Bend a scan so that what it shares with another one lies there, if they share a region.

    Return it with the numbers of its vertices, without loose pieces that share nothing.
    """
    match = match_shapes(mesh, other, overlap="partial")
    if not match.mapped.any():
        return None
    _, labels = vertex_components(mesh)
    shares = np.isin(labels, labels[match.mapped])
    mesh, numbers = submesh(mesh, shares[mesh.faces].all(axis=1))
    fixed, images = match.mapped[numbers], match.pull(other.vertices)[numbers]
    # The rest first moves along as it is; then edges become as rigid as they can be.
    motion = fit_motion(mesh.vertices[fixed], images[fixed])
    start = np.where(fixed[:, None], images, motion.move(mesh.vertices))
    turn = np.roll(Rotation.from_matrix(motion.rotation).as_quat(), 1)
    turns = np.tile(turn, (mesh.n_vertices, 1))
    edges = edge_weights(mesh, surface_laplacian(mesh).stiffness)
    bent = relax(edges, free_part(edges, fixed), mesh.vertices, start, turns, N_ROUNDS)
    return TriangleMesh(bent, mesh.faces), numbers


def _meshes_of(scans: object) -> list[TriangleMesh]:
    """Return a list of meshes; raise an error if it is none."""
    if not isinstance(scans, Sequence) or isinstance(scans, str):
        raise InvalidParameterError(
            f"scans must be a list of meshes; it is a {type(scans).__name__}. Pass [scans]."
        )
    if not scans:
        raise InvalidParameterError("scans must hold at least one scan; it is empty.")
    return [as_mesh(scan, f"scan {number}") for number, scan in enumerate(scans)]


def _placed(k: int, found: dict[tuple[int, int], Registration]) -> tuple[Registration | None, ...]:
    """Return the motion of each scan to the first that is joined with most others.

    The pairs of best scores join groups of scans, as in Kruskal's algorithm.
    """
    groups: list[dict[int, Registration]] = [
        {number: Registration(NO_MOTION.rotation, NO_MOTION.translation, 1.0)}
        for number in range(k)
    ]
    order = sorted(
        (pair for pair in found if pair[0] < pair[1] and found[pair].score >= LEAST_SCORE),
        key=lambda pair: (-found[pair].score, pair),
    )
    for one, two in order:
        mine = next(group for group in groups if one in group)
        other = next(group for group in groups if two in group)
        if mine is other:
            continue
        # From the frame of the other group to scan two, to scan one, to the frame of this group
        across = mine[one].after(found[two, one]).after(other[two].inverse())
        mine |= {number: across.after(motion) for number, motion in other.items()}
        groups = [group for group in groups if group is not other]
    best = max(groups, key=lambda group: (len(group), -min(group)))
    home = best[min(best)].inverse()
    return tuple(home.after(best[number]) if number in best else None for number in range(k))
