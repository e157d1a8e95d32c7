"""The road from a mesh to its parts: limbs, head, torso."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import frozen, whole_number
from eigenshape._progress import Progress
from eigenshape.features.boundaries import CONCAVITY, smooth_boundaries
from eigenshape.features.part_hierarchy import PartTree
from eigenshape.features.part_merging import SEED_TIME, part_tree
from eigenshape.features.segmentation import Segmentation, segment
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.fragments import fragment_vertices
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_describable
from eigenshape.geometry.topology import is_closed, vertex_components
from eigenshape.operators.anisotropic import anisotropic_laplacian, curvature_tensors
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

N_MODES = 25  # beside one for each component
PART_CONTRAST = 0.3  # parts between which more is left of a difference are two


@dataclass(frozen=True, eq=False)
class FoundParts:
    """The parts of a shape with all that was found on the way to them.

    Attributes
    ----------
    mesh : TriangleMesh
        As it was given, or turned to face outward.
    spectrum : Spectrum
        Of a Laplacian that conducts badly across concave creases; with zeros on fragments, whose pairs are left out.
    heat : (n,) float
        What seeds are the maxima of, in 1/length².
    tree : PartTree
        Which part splits from which; it can be cut elsewhere without computing anything again.
    parts : Segmentation
    """

    mesh: TriangleMesh
    spectrum: Spectrum
    heat: Float[np.ndarray, " n"]
    tree: PartTree
    parts: Segmentation


def find_parts(
    mesh: MeshLike, *, n_modes: int = N_MODES, progress: Progress | None = None
) -> FoundParts:
    """Find the parts of a surface: rooms between which heat flows badly, cut along concave creases.

    Heat flows slowly across concave creases (`curvature_tensors`, α = 10); regions around the maxima of early heat are
    merged in the order in which heat evens them out (`part_tree`); those are parts of which more than 0.3 of a
    difference is left, and their boundaries are moved to the least cut (`smooth_boundaries`). All times are shares of
    the area, so no unit counts.

    Each component is a part at least. A fragment of less than a hundredth of the area (`fragment_vertices`) is exactly
    one: it comes to one temperature long before the time at which parts are told apart.

    Parameters
    ----------
    mesh : MeshLike
        A closed surface is turned outward; of an open one the faces are seen from outside counter-clockwise.
    n_modes : int
        Eigenpairs, at least 2, to which one is added for each component that is no fragment.
    progress : callable, optional
        Told of the eigensolver's progress.

    Returns
    -------
    FoundParts

    Raises
    ------
    InvalidParameterError
        If there are fewer than 2 modes.
    InvalidShapeError
        If the mesh has a face without area or twice, or a vertex without face; if neighboring faces are turned against
        each other; or if it is a soup, whose faces lie edge on edge without sharing vertices.
    """
    mesh = as_mesh(mesh)
    outward = facing_outward(mesh)
    spectrum = part_spectrum(outward, n_modes=n_modes, progress=progress)
    tree = part_tree(outward, spectrum)
    heat = heat_kernel_signature(spectrum, [SEED_TIME * float(spectrum.mass.sum())])[:, 0]
    parts = smooth_boundaries(outward, segment(tree, persistence=PART_CONTRAST))
    return FoundParts(outward, spectrum, frozen(heat), tree, parts)


def part_spectrum(
    mesh: MeshLike, *, n_modes: int = N_MODES, progress: Progress | None = None
) -> Spectrum:
    """Solve for the lowest modes of a Laplacian that conducts badly across concave creases, fragments left out.

    Parameters and errors are those of `find_parts`, the faces of the mesh being turned outward.
    """
    mesh = as_mesh(mesh)
    require_describable(mesh)
    fragments = fragment_vertices(mesh)
    _, labels = vertex_components(mesh)
    n_components = len(np.unique(np.delete(labels, fragments)))
    wanted = whole_number(n_modes, "n_modes", 2) + n_components
    laplacian = anisotropic_laplacian(mesh, curvature_tensors(mesh, CONCAVITY, concave=True))
    n_pairs = min(wanted, mesh.n_vertices - len(fragments))
    return solve_spectrum(laplacian, n_pairs, fixed=fragments, progress=progress)


def facing_outward(mesh: TriangleMesh) -> TriangleMesh:
    """Return a closed mesh with its faces seen from outside counter-clockwise; an open one as it is."""
    if not is_closed(mesh) or enclosed_volume(mesh) >= 0:
        return mesh
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
