"""Find the parts of a mesh: limbs, head, torso."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, finite_values, record, whole_number
from certeig.kit.progress import Progress
from certeig.kit.threads import one_blas_thread
from eigenshape.features.boundaries import CONCAVITY, move_boundaries, smooth_boundaries
from eigenshape.features.contrast import FINE_CONTRAST, PART_CONTRAST, contrast_at
from eigenshape.features.crease_parts import crease_tree
from eigenshape.features.part_contrast import weigh_parts
from eigenshape.features.part_merging import SEED_TIME, part_tree
from eigenshape.features.region_tree import PartTree
from eigenshape.features.segmentation import Segmentation, segment
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_closed_outward
from eigenshape.geometry.repairs.repair_steps import fragment_vertices
from eigenshape.geometry.requirements import require_describable
from eigenshape.geometry.topology import is_closed, vertex_components
from eigenshape.operators import elements
from eigenshape.operators.anisotropic import curvature_tensors
from eigenshape.operators.cotangent import linear_laplacian
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

# Eigenpairs, beside one for each component. Of 15, 25 and 40, 25 was chosen on the tuning half of
# experiments/ch5_parts, where 15 were as good.
N_MODES = 25


@record
class PartDecomposition(ReadOnly):
    """The parts of a surface and the intermediate results of `find_parts`.

    Attributes
    ----------
    mesh : TriangleMesh
        The given mesh; if it is closed, with its faces oriented outward.
    spectrum : Spectrum
        Spectrum of a Laplacian that conducts little heat across concave creases. Fragments have no
        eigenpairs of their own; the eigenvectors are 0 there.
    heat : (n,) float
        Heat kernel signature whose maxima are the seeds of parts, in 1/length².
    tree : PartTree
        Tree in which the parts merge. Its persistence is that of `part_tree` below 0.15, and above
        it the share o / (1 + o) of the odds o of `find_parts`. `segment` can cut it elsewhere
        without further computation. Parts that rise from flat ledges are in a tree of their own.
    fine : Segmentation
        The smallest parts with smooth boundaries. Parts up to level 1 are unions of these.
    parts : Segmentation
        The part of each face.

    See Also
    --------
    find_parts : Compute a decomposition.

    Examples
    --------
    >>> import eigenshape as es
    >>> found = es.find_parts(es.make_creature("biped", n_vertices=1200))
    >>> len(found.parts.features.vertices), found.heat.shape
    (9, (1200,))
    """

    mesh: TriangleMesh
    spectrum: Spectrum
    heat: Float[np.ndarray, " n"]
    tree: PartTree
    fine: Segmentation
    parts: Segmentation

    def smooth(self, cut: Segmentation) -> Segmentation:
        """Move the boundaries of another cut of the tree to short cuts along creases.

        Parameters
        ----------
        cut : Segmentation
            Of `tree`, by `segment`.

        Returns
        -------
        Segmentation
        """
        require_type(cut, Segmentation, "cut")
        if len(cut.features.vertices) > len(self.fine.features.vertices):
            return smooth_boundaries(self.mesh, cut)
        rough = segment(self.tree, persistence=FINE_CONTRAST)
        return _join_fine_parts(rough, self.fine, cut)


@one_blas_thread()
def find_parts(
    mesh: MeshLike,
    *,
    level: float = 0.0,
    n_modes: int = N_MODES,
    progress: Progress | None = None,
) -> PartDecomposition:
    """Find the parts of a surface, such as limbs, head and torso.

    A part is a region with little heat flow across its boundary, a crease around it, a thickness of
    its own, or points that see each other but not those of its neighbors. Heat flows slowly across
    concave creases (`curvature_tensors`, α = 10). The basins of the maxima of early heat are merged
    in the order in which diffusion equalizes them (`part_tree`) while less than 0.15 of a
    temperature difference is left, and each boundary is moved to the shortest cut nearby
    (`smooth_boundaries`). The parts so found are merged further, cheapest pair first. The odds that
    two adjacent parts R and S are seen as two are

        o ∝ (|R||S| / (|R| + |S|))^0.6 · |c_R - c_S|² · exp(0.6 ϑ + 0.5 |log r_R - log r_S|)
            · (min(v_R, v_S) + 0.05) / (v_RS + 0.05),

    where |R| and |S| are shares of the area, c is the mean of e^{-tλ} φ as in `part_tree`, ϑ is the
    mean angle by which the surface turns across the boundary, positive where it is concave (the
    minima rule of Hoffman and Richards 1984), r is the radius of the inscribed balls (Shapira,
    Shamir and Cohen-Or 2008), and v_RS is the share of the short lines between points of R and S
    that run inside the solid at both ends (Asafi, Goren and Cohen-Or 2013). The tree is cut where
    o / (1 + o) is 0.3; of two ends of a body that are about as clear, such as those of a long bone,
    where the clearer one has it. All times and lengths are relative to the surface area, so the result does
    not depend on the unit of length.

    A closed body may have parts that rise from flat ledges behind concave creases, such as the
    bosses and ribs of a machine part. If there are at least as many of them as of the parts above,
    they are the result. Their odds are

        o = (area of the ledge / area of the cross-section) · min(3, l / m),

    where the cross-section lies in the plane of the ledge, and the boundary of the part has the
    length l along creases and m elsewhere. A crease is an edge where the surface turns by more than
    40° or, on shapes whose faces are nowhere flat, up to 70°. A convex body is one part.

    Each component has at least one part. A fragment with less than a hundredth of the area
    (`fragment_vertices`) is always exactly one part.

    Parameters
    ----------
    mesh : MeshLike
        A closed surface is oriented outward first. The faces of an open surface must be
        counter-clockwise as seen from outside.
    level : float
        From coarse to fine: at level 1 a part needs half the persistence that it needs at level 0,
        at level -1 twice as much. The parts of a finer level are those of a coarser one or lie
        within them, up to the smoothing of their boundaries.
    n_modes : int
        Number of eigenpairs, at least 2; one is added for each component that is not a fragment.
    progress : callable, optional
        Called as ``progress(fraction_done, message)`` by the eigensolver.

    Returns
    -------
    PartDecomposition

    Raises
    ------
    InvalidParameterError
        If `n_modes` is less than 2, or `level` is not finite.
    InvalidShapeError
        If the mesh has a face without area, a duplicate face or a vertex without a face; if
        neighboring faces are oriented against each other; or if faces lie edge to edge without
        sharing vertices.

    See Also
    --------
    segment : Cut the resulting tree elsewhere.
    transfer_labels : Copy labels from the parts of one shape to those of another.

    Examples
    --------
    A dumbbell is two parts:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> x, y, z = ball.vertices.T
    >>> thickness = 0.1 + z**2
    >>> dumbbell = es.TriangleMesh(np.column_stack([thickness * x, thickness * y, z]), ball.faces)
    >>> found = es.find_parts(dumbbell)
    >>> len(found.parts.features.vertices)
    2

    At a coarser level it is one, at a finer level two still:

    >>> [len(es.find_parts(dumbbell, level=level).parts.features.vertices) for level in (-2, 1)]
    [1, 2]

    The tree can be cut again, for example to keep the whole shape together:

    >>> len(es.segment(found.tree, n_regions=1).features.vertices)
    1
    """
    mesh = as_mesh(mesh)
    (fineness,) = finite_values(level, "level")
    outward = orient_closed_outward(mesh)
    require_describable(outward)
    tensors = curvature_tensors(outward, CONCAVITY, concave=True)
    spectrum = _solve_parts(outward, tensors, n_modes, progress)
    tree = part_tree(outward, spectrum)
    heat = heat_kernel_signature(spectrum, [SEED_TIME * float(spectrum.mass.sum())])[:, 0]
    rough = segment(tree, persistence=FINE_CONTRAST)
    fine = move_boundaries(outward, rough, tensors)
    tree = weigh_parts(outward, tree, fine, spectrum)
    fine = _join_fine_parts(rough, fine, segment(tree, persistence=FINE_CONTRAST))
    if is_closed(outward):
        creased = crease_tree(outward, heat)
        counts = [np.sum(each.persistence >= PART_CONTRAST) for each in (tree, creased)]
        # Heat finds hardly a part of a body of few, long faces, and finds soft parts that rise
        # without a crease. What creases bound is exact, so it is preferred where it is as much.
        if 1 < counts[1] >= counts[0]:
            tree, fine = creased, segment(creased, persistence=FINE_CONTRAST)
    cut = segment(tree, persistence=contrast_at(float(fineness)))
    found = PartDecomposition(outward, spectrum, heat, tree, fine, cut)
    return replace(found, parts=found.smooth(cut))


def _join_fine_parts(rough: Segmentation, fine: Segmentation, cut: Segmentation) -> Segmentation:
    """Join fine parts, whose boundaries are smooth, as a cut joins them before smoothing.

    `rough` has the labels of `fine` before smoothing; each part of the cut is a union of some.
    """
    _, first_faces = np.unique(rough.labels, return_index=True)
    return Segmentation(cut.labels[first_faces][fine.labels], cut.features)


def _solve_parts(
    mesh: TriangleMesh,
    tensors: Float[np.ndarray, "f 3 3"],
    n_modes: int,
    progress: Progress | None,
) -> Spectrum:
    """Solve the Laplacian with these conductivity tensors; the eigenvectors are 0 on fragments."""
    fragments = fragment_vertices(mesh)
    _, labels = vertex_components(mesh)
    n_components = len(np.unique(np.delete(labels, fragments)))
    wanted = whole_number(n_modes, "n_modes", 2) + n_components
    # `anisotropic_laplacian`, without its checks of tensors and mesh, which have been made.
    laplacian = linear_laplacian(mesh, elements.gradient_products(mesh, tensors), "lumped")
    n_pairs = min(wanted, mesh.n_vertices - len(fragments))
    return solve_spectrum(laplacian, n_pairs, fixed=fragments, progress=progress)
