"""The repair that a message names is applied, until the function answers."""

import re

import numpy as np
import pytest
from broken_meshes import (
    everted,
    flipped,
    moebius,
    soup,
    with_duplicates,
    with_flat_simplices,
    with_loose_points,
)

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.distances.closest import signed_distance
from eigenshape.geometry.distances.geodesic import average_geodesic_distance
from eigenshape.geometry.facets import boundary_surface
from eigenshape.geometry.measure import enclosed_volume, surface_area, vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_mesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.repairs.masks import mask_surface
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.requirements import require_describable, require_sound
from eigenshape.geometry.resolution.decimation import decimate
from eigenshape.geometry.resolution.tetrahedralization import tetrahedralize
from eigenshape.geometry.topology import disjoint_union, vertex_components
from eigenshape.shapes.domains import box
from eigenshape.shapes.surfaces import icosphere

BALL = icosphere(2)
SMALL = TriangleMesh(BALL.vertices / 2, BALL.faces)
CUBE = boundary_surface(box(2, 2, 2))
BESIDE = TriangleMesh(CUBE.vertices + np.array([1.0, 1, 0]), CUBE.faces)
MOST_REMEDIES = 3


def answer(function, mesh):
    """Apply what each refusal names; return the names that were applied."""
    applied = []
    for _ in range(MOST_REMEDIES):
        try:
            function(mesh)
        except InvalidShapeError as error:
            (named,) = re.findall(r"repair\(mesh, \[(.*?)\]\)", str(error))
            applied.append(named.replace('"', ""))
            mesh = repair(mesh, applied[-1].split(", ")).mesh
        else:
            return applied
    function(mesh)
    return applied


def broken():
    rng = np.random.default_rng(0)
    noise = 1e-16 * rng.standard_normal((3 * BALL.n_faces, 3))
    single = soup(BALL)
    yield average_geodesic_distance, disjoint_union(BALL, BALL, SMALL), ["largest_component"]
    yield lambda mesh: signed_distance(mesh, [[0, 0, 0]]), everted(BALL), ["orient"]
    yield enclosed_volume, flipped(BALL, rng), ["auto"]
    yield vertex_normals, disjoint_union(moebius(), flipped(BALL, rng)), ["auto, cut_one_sided"]
    ugly = with_loose_points(with_flat_simplices(with_duplicates(BALL, rng), rng), rng)
    yield require_sound, ugly, ["auto"]
    yield require_describable, with_duplicates(BALL, rng), ["auto"]
    yield require_describable, TriangleMesh(single.vertices + noise, single.faces), ["auto"]


@pytest.mark.parametrize(("function", "mesh", "names"), [*broken()])
def test_the_repair_that_is_named_helps(function, mesh, names):
    assert answer(function, mesh) == names


@pytest.mark.parametrize(
    ("mesh", "names"),
    [
        (disjoint_union(BALL, SMALL), ["orient"]),
        (TriangleMesh(BALL.vertices, BALL.faces[1:]), ["auto, fill_holes"]),
        (TriangleMesh(soup(BALL).vertices, soup(BALL).faces), ["auto, fill_holes"]),
        (flipped(BALL, np.random.default_rng(1)), ["auto"]),
        (disjoint_union(CUBE, BESIDE), ["weld"]),
        (disjoint_union(CUBE, everted(BESIDE)), ["weld", "orient"]),
    ],
)
def test_the_repair_that_is_named_fills_a_surface(mesh, names):
    pytest.importorskip("netgen.meshing", reason="the extra tetrahedralize is missing")
    assert answer(tetrahedralize, mesh) == names


@pytest.mark.parametrize("mesh", [flipped(BALL, np.random.default_rng(2)), soup(BALL)])
def test_the_repair_that_is_named_makes_fewer_faces(mesh):
    pytest.importorskip("igl", reason="the extra decimate is missing")
    assert answer(lambda mesh: decimate(mesh, 100), mesh) in (
        ["auto"],
        [],
        ["auto, largest_component"],
    )


def test_other_calls_that_are_named_help():
    opened = everted(TriangleMesh(BALL.vertices, BALL.faces[1:]))
    with pytest.raises(InvalidShapeError, match=r"Try orient_outward\(mesh\)"):
        signed_distance(opened, [[0, 0, 0]])
    assert signed_distance(orient_outward(opened), [[0, 0, 0]])[0] < 0
    large = TriangleMesh(1e200 * BALL.vertices, BALL.faces)
    with pytest.raises(
        InvalidShapeError, match=r'as normalize_mesh\(mesh, "box"\) does for surfaces'
    ):
        surface_area(large)
    assert surface_area(normalize_mesh(large, "box")) > 2
    with pytest.warns(UserWarning, match=r"es.repair\(part.mesh, \['largest_component'\]\) keeps"):
        part = mask_surface(BALL, np.abs(BALL.vertices[:, 2]) > 0.3)
    assert vertex_components(repair(part.mesh, ["largest_component"]).mesh)[0] == 1
