"""How stable is a spectrum? A made-up giraffe beside itself with noise, and in another pose.

`eigenshape stability clean.ply noisy.ply --picture report.png` does the same with files.
"""

import tempfile
from pathlib import Path

import numpy as np

import eigenshape as es

PLAN = es.stability.StabilityPlan(k=12, n_samples=500)


def main(folder: Path) -> dict[str, es.stability.StabilityReport]:
    """Compare a giraffe with a noisy one and with one that stands otherwise."""
    giraffe = es.make_creature("giraffe", 0, n_vertices=1500)
    heights = (
        0.2
        * es.geometry.mean_side_length(giraffe)
        * np.random.default_rng(0).standard_normal((giraffe.n_vertices, 1))
    )
    others = {
        "noisy": es.TriangleMesh(
            giraffe.vertices + heights * es.geometry.vertex_normals(giraffe), giraffe.faces
        ),
        "posed": es.make_creature("giraffe", 1, n_vertices=1500),
    }
    reports = {name: es.compare_shapes(giraffe, other, PLAN) for name, other in others.items()}
    for name, report in reports.items():
        figure = es.plot.figure_stability(report, giraffe, others[name], titles=("giraffe", name))
        es.save_figure(figure, folder / f"{name}.png")
    return reports


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        for name, report in main(Path(temporary)).items():
            print(f"{name}\n{report.explain()}\n")
