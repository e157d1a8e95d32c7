"""
Check an operator of your own
=============================

An operator is two sparse matrices, and `es.check_operator` says which laws of a Laplace operator they
keep. This one weighs each edge by one over its length, as somebody might try.
"""

import scipy.sparse as sp

import eigenshape as es


def inverse_length_laplacian(mesh):
    """Weigh edges by one over their length, and vertices by their area."""
    edges = es.geometry.edge_table(mesh).edges
    half = sp.coo_array(
        (1 / es.geometry.edge_lengths(mesh), edges.T), shape=(mesh.n_vertices,) * 2
    ).tocsr()
    weights = half + half.T
    stiffness = sp.diags_array(weights.sum(axis=1)) - weights
    return es.Laplacian(stiffness, sp.diags_array(es.geometry.dual_volumes(mesh)).tocsr())


report = es.check_operator(inverse_length_laplacian, es.icosphere(2))
print(report.explain())

# %%
# Its eigenfunctions look right on an even mesh, and are wrong where triangles are smaller on one
# side: the pattern should be a straight half and half.

sphere = es.shapes.uneven_sphere(1500)
fields = {
    name: (sphere, es.solve_spectrum(build(sphere), 2).eigenvectors[:, 1])
    for name, build in {
        "inverse length": inverse_length_laplacian,
        "cotangent": es.cotangent_laplacian,
    }.items()
}
es.plot.figure_fields(fields, "first eigenfunction", color_map="RdBu_r")
