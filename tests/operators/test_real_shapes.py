"""Every operator on real and awkward files: the laws hold, or the error has a name."""

from contextlib import suppress

import numpy as np
import pytest

from certeig.kit.errors import CerteigError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.io.shape_files import read_shape
from eigenshape.operators.catalog import OPERATORS, build_laplacian

FOLDERS = ("nasty", "tets", "points")
pytestmark = [
    pytest.mark.data,
    pytest.mark.filterwarnings(
        "ignore:With the heat time",
        "ignore:A kernel of width",
        "ignore:A kernel must reach",
        "ignore:Both sides of a seam",
        "ignore:All .* eigenvalues are 0",
        "ignore:.* were split into .* tetrahedra",
    ),
]


def keeps_the_laws(laplacian):
    largest = laplacian.stiffness.max()
    sums = np.abs(laplacian.stiffness @ np.ones(laplacian.n_points)).max()
    fields = np.random.default_rng(0).normal(size=(laplacian.n_points, 3))
    energies = np.einsum("ij,ij->j", fields, laplacian.stiffness @ fields)
    return sums <= 1e-10 * largest and (energies > 0).all() and laplacian.mass.diagonal().min() > 0


def shapes(folder):
    for path in sorted(
        path for name in FOLDERS for path in (folder / name).rglob("*") if path.is_file()
    ):
        with suppress(CerteigError):  # which tests/io look at
            yield path, read_shape(path)


@pytest.mark.long
@pytest.mark.parametrize("name", OPERATORS)
def test_every_file_gives_a_sound_operator_or_a_named_error(data, name):
    built, refused = [], []
    for path, shape in shapes(data):
        if not isinstance(shape, OPERATORS[name].shapes):
            continue
        try:
            laplacian = build_laplacian(shape, name)
        except CerteigError as error:
            refused.append(str(error))
            continue
        assert laplacian.n_points == 1 or keeps_the_laws(laplacian), path.name
        built.append(path.name)
    expected = 7 if name == "point-cloud" else 40
    assert len(built) >= expected, (len(built), refused)
    assert all(len(message) > 40 for message in refused)  # a sentence, not a word


def test_all_tetrahedra_curves_and_clouds_are_read(data):
    kinds = {
        path.name: shape for path, shape in shapes(data) if path.parent.name in ("tets", "points")
    }
    assert {name for name, shape in kinds.items() if isinstance(shape, PointCloud)} == {
        "bunny16k.pts",
        "chameleon4k.pts",
        "fragment_000.ply",
        "milk.pcd",
    }
    counts = {
        name: (shape.n_points, shape.dim)
        for name, shape in kinds.items()
        if isinstance(shape, SimplicialMesh)
    }
    assert counts == {
        "bunny.mesh": (5433, 3),
        "ellipsoid.mesh": (7293, 3),
        "octopus-low.mesh": (452, 3),
        "sphere.mesh": (4505, 3),
        "track1.binary.vtk": (16267, 1),
    }
