"""The pose of one shape, given to another."""

import numpy as np

import eigenshape as es

N_CARRIED = 40  # modes of a functional map that carry a pose, as in experiments/ch6_deformation
N_SOLVED = 100  # modes that are solved for to refine that map
# Modes of the map before it is refined, for exact pairs and for those of patches; as the
# documentation of `functional_map` recommends.
N_EXACT, N_INEXACT = 20, 10


def carry_pose(
    source: es.TriangleMesh,
    posed: es.TriangleMesh,
    target: es.TriangleMesh,
    pairs: np.ndarray | None = None,
) -> es.TriangleMesh:
    """Bend a target as a source was bent.

    Parameters
    ----------
    source, posed : TriangleMesh
    target : TriangleMesh
    pairs : (p, 2) int, optional
        Corresponding vertices of source and target. By default vertices of the same number if both
        have the same faces, else points whose patches match.

    Returns
    -------
    TriangleMesh
    """
    n_pairs_modes = N_EXACT
    if pairs is None and np.array_equal(source.faces, target.faces):
        pairs = np.repeat(np.arange(source.n_vertices)[:, None], 2, axis=1)
    if pairs is None:
        pairs = match_vertices(source, target)
        n_pairs_modes = N_INEXACT
    k = min(N_SOLVED, source.n_vertices, target.n_vertices)
    one, two = (es.solve_spectrum(es.cotangent_laplacian(mesh), k) for mesh in (source, target))
    rough = es.functional_map(one, two, pairs, n_modes=min(n_pairs_modes, k))
    mapping = es.spectral.refine_map(rough, min(N_CARRIED, k))
    return es.deformation.transfer_deformation(source, posed, target, mapping)


def match_vertices(source: es.TriangleMesh, target: es.TriangleMesh) -> np.ndarray:
    """Return pairs of vertices whose patches match. They may be mirrored as a whole."""
    recipe = es.retrieval.PatchRecipe()
    patches = [
        es.retrieval.patch_descriptor(es.retrieval.extract_patches(mesh, n_views=0), recipe)
        for mesh in (source, target)
    ]
    one, two = (descriptor.points[0] for descriptor in patches)
    return es.retrieval.match_patches(one, two).vertices
