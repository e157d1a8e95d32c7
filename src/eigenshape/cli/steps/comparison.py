"""What `stability` prints about two shapes, and the scale at which it compares them."""

from dataclasses import asdict
from typing import Any

import numpy as np

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import out, print_table
from eigenshape.cli.inputs import Scale
from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_mesh
from eigenshape.stability.report import StabilityReport


def scale_shape(shape: Shape, scale: Scale) -> Shape:
    """Center a shape and scale it to area 1 or to diameter 1, as --scale says.

    Raises
    ------
    InvalidParameterError
        If it is no triangle mesh.
    """
    if scale == "none":
        return shape
    if not isinstance(shape, TriangleMesh):
        raise InvalidParameterError(f"--scale is for triangle meshes; the shape is {shape!r}.")
    return normalize_mesh(shape, scale)


def stability_facts(report: StabilityReport) -> dict[str, Any]:
    """Gather what there is to say about two shapes."""
    compared, angles = report.spectra, report.angles
    return {
        "spectra": {
            **asdict(compared),
            "proved": compared.proved_changes,
            "hausdorff": compared.hausdorff,
            "index_distance": compared.index_distance,
            "mean_relative": compared.mean_relative,
            "median_relative": compared.median_relative,
        },
        "distance": report.distance,
        "matching_distance": report.matching_distance,
        "sampling_distance": report.sampling_distance,
        "delta": report.delta,
        "delta_of_the_map": report.closeness.delta if report.closeness else None,
        "times": {
            **asdict(report.times),
            "empty": report.times.empty,
            "low_reason": report.times.low_reason,
        },
        "changes": [
            {**asdict(change), "significant": change.significant} for change in report.changes
        ],
        "eigenspaces": asdict(angles),
        "n_samples": report.n_samples,
        "explanation": report.explain(),
    }


def print_stability(report: StabilityReport) -> None:
    """Print the eigenvalues of both shapes and their changes at each heat time."""
    compared = report.spectra
    pairs = np.where(compared.zero[:, None], 0.0, np.column_stack([compared.one, compared.two]))
    rows = [
        [str(number), f"{one:.6g}", f"{two:.6g}", f"{change:.2%}", "yes" if proved else "no"]
        for number, ((one, two), change, proved) in enumerate(
            zip(pairs, compared.relative, compared.proved_changes, strict=True)
        )
    ]
    print_table("Eigenvalues, in 1/length²", ["i", "first", "second", "change", "proved"], rows)
    heat = [
        [
            f"{row.t:.3g}",
            f"{row.change:.3g}",
            f"{row.floor:.3g}",
            f"{row.weyl:.3g}",
            "yes" if row.admissible else "no",
        ]
        for row in report.changes
    ]
    title = f"Largest change of {len(rows)} eigenvalues of graph Laplacians, over the last, at heat time t (length²)"
    print_table(title, ["t", "shapes", "samples", "Weyl's bound", "admissible"], heat)
    out.print(report.explain())
