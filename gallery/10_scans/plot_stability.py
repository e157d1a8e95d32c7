"""
What does noise do to a spectrum?
=================================

A report on two shapes says which eigenvalues change, what theorems allow, and at which heat times the
shapes can be told apart.
"""

import numpy as np

import eigenshape as es

giraffe = es.make_creature("giraffe", n_vertices=1200)
rng = np.random.default_rng(0)
heights = 0.2 * es.geometry.mean_side_length(giraffe) * rng.standard_normal((giraffe.n_vertices, 1))
noisy = es.TriangleMesh(
    giraffe.vertices + heights * es.geometry.vertex_normals(giraffe), giraffe.faces
)
plan = es.stability.StabilityPlan(k=12, n_samples=400)
report = es.compare_shapes(giraffe, noisy, plan)
print(report.explain())

# %%
# The same as a picture.

es.plot.figure_stability(report, giraffe, noisy, titles=("giraffe", "with noise"))
