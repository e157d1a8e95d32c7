"""Values of another type are refused with the call that makes the right one."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from certeig.kit.arguments import require_each, require_type
from certeig.kit.errors import InvalidParameterError
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.geometry.cloud import PointCloud
from eigenshape.operators.laplacian import Laplacian
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.spectrum import Spectrum

MESH = icosphere(0)
UNIT = sp.eye_array(3, format="csr")


@dataclass
class Kept:
    """What holds a Laplacian."""

    name: str
    laplacian: Laplacian


@pytest.mark.parametrize(
    ("value", "kind", "message"),
    [
        (MESH, Laplacian, r"the value is a TriangleMesh\. Pass es\.cotangent_laplacian\(mesh\)\."),
        (
            PointCloud(MESH.vertices),
            Laplacian,
            r"is a PointCloud\. Pass es\.point_cloud_laplacian\(cloud\)\.",
        ),
        (UNIT, Laplacian, r"the value is a csr_array\. Pass es\.Laplacian\(stiffness, mass\)\."),
        (
            Kept("it", Laplacian(UNIT, UNIT)),
            Laplacian,
            r"the value is a Kept\. Pass its attribute laplacian\.",
        ),
        (
            Path("cat.npz"),
            Spectrum,
            r"is a PosixPath \('cat\.npz'\)\. Pass es\.Spectrum\.load\('cat\.npz'\)\.",
        ),
        (None, Spectrum, r"the value is None\. Pass es\.solve_spectrum\(laplacian, k\)\."),
        (
            2.5,
            Spectrum | None,
            r"Spectrum or None; the value is a float \(2\.5\)\. Pass es\.solve_spectrum",
        ),
        (
            np.eye(3),
            Rotation | Translation,
            r"an ndarray\. Pass es\.Rotation\(pivot, axis, angle\) or es\.Translation",
        ),
    ],
)
def test_another_type_is_refused_with_what_to_pass(value, kind, message):
    with pytest.raises(InvalidParameterError, match=f"^given must be .*{message}"):
        require_type(value, kind, "given")


def test_the_right_type_passes():
    require_type(None, Spectrum | None, "given")
    require_type(Laplacian(UNIT, UNIT), Laplacian, "given")
    require_each([Translation([0, 0, 1])], Rotation | Translation, "handles")


def test_a_list_is_one_of_the_right_type():
    lone = Translation([0, 0, 1])
    with pytest.raises(
        InvalidParameterError,
        match=r"handles must be a list, each entry .*; it is a Trans.*Pass \[hand",
    ):
        require_each(lone, Rotation | Translation, "handles")
    with pytest.raises(
        InvalidParameterError,
        match=r"handles must be a list, each entry a Rotation or .*; it is None",
    ):
        require_each(None, Rotation | Translation, "handles")
    with pytest.raises(
        InvalidParameterError,
        match=r"handles\[1\] must be a Rotation .*; the value is an int \(3\)",
    ):
        require_each([lone, 3], Rotation | Translation, "handles")
