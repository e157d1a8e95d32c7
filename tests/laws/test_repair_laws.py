"""What repairs promise of any broken mesh."""

import numpy as np
import pytest
from broken_meshes import (
    cut_open,
    everted,
    flipped,
    moebius,
    soup,
    with_duplicates,
    with_flat_simplices,
    with_loose_points,
    with_slivers,
    with_specks,
    without_faces,
)
from hypothesis import example, given, settings
from hypothesis import strategies as st

from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair, suggest_repairs
from eigenshape.geometry.requirements import require_describable, require_oriented, require_sound
from eigenshape.geometry.topology import disjoint_union, is_closed
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import grid, icosphere, torus

BASES = {
    "ball": icosphere(1),
    "torus": torus(9, 6),
    "sheet": grid(4, 3),
    "creature": make_creature("quadruped", n_vertices=500),
    "hollow": disjoint_union(
        icosphere(1), TriangleMesh(0.4 * icosphere(0).vertices, icosphere(0).faces[:, ::-1])
    ),
    "pair": disjoint_union(icosphere(1), TriangleMesh(torus(7, 5).vertices + 9, torus(7, 5).faces)),
}
DAMAGES = {
    "soup": lambda mesh, rng: soup(mesh),
    "everted": lambda mesh, rng: everted(mesh),
    "flipped": flipped,
    "duplicates": with_duplicates,
    "loose": with_loose_points,
    "flat": with_flat_simplices,
    "slivers": with_slivers,
    "specks": with_specks,
    "holes": without_faces,
    "cut": cut_open,
    "strip": lambda mesh, rng: disjoint_union(mesh, moebius(8, 1)),
}
broken = st.tuples(
    st.sampled_from(sorted(BASES)),
    st.lists(st.sampled_from(sorted(DAMAGES)), max_size=5),
    st.integers(0, 2**32 - 1),
)


def build(case):
    """Return the base and what damages, one after the other, make of it."""
    base, damages, seed = case
    mesh, rng = BASES[base], np.random.default_rng(seed)
    for name in damages:
        mesh = DAMAGES[name](mesh, rng)
    return mesh


@settings(deadline=None, max_examples=60)
@given(broken)
@example(
    ("ball", ["soup", "flipped", "duplicates", "loose", "flat", "specks", "holes", "everted"], 0)
)
@example(("ball", ["holes", "everted"], 1))  # inward once it is closed
@example(("ball", ["holes", "holes"], 0))  # of different numbers of edges
def test_what_is_suggested_leaves_nothing_to_suggest(case):
    mesh = build(case)
    names = suggest_repairs(mesh)
    assert suggest_repairs(repair(mesh, names).mesh) == ()


@settings(deadline=None, max_examples=60)
@given(broken)
def test_auto_leaves_what_everything_takes_and_is_done_at_once(case):
    mesh = build(case)
    done = repair(mesh, ["auto"])
    np.testing.assert_array_equal(done.mesh.vertices, mesh.vertices[done.source_vertices])
    require_sound(done.mesh)
    require_describable(done.mesh)
    if "one side only" not in "".join(done.report) and "strip" not in case[1]:
        require_oriented(done.mesh)
    again = repair(done.mesh, ["auto"])
    # A second time it says again what it leaves, and does nothing.
    left = [sentence for sentence in done.report if sentence.startswith("auto left")]
    assert list(again.report) == left
    assert again.mesh is done.mesh


@settings(deadline=None, max_examples=30)
@given(st.sampled_from(["ball", "torus", "creature", "hollow", "pair"]), st.integers(0, 2**32 - 1))
def test_auto_gives_back_a_closed_mesh(base, seed):
    """Whatever broke it without a loss, the same faces are at the same places."""
    mesh, rng = BASES[base], np.random.default_rng(seed)
    damages = rng.permutation(["soup", "flipped", "duplicates", "loose", "flat", "cut"])
    found = repair(build((base, damages.tolist(), seed)), ["auto"]).mesh
    assert (found.n_vertices, found.n_faces) == (mesh.n_vertices, mesh.n_faces)
    expected = {frozenset(map(tuple, corners)) for corners in mesh.vertices[mesh.faces].tolist()}
    assert {
        frozenset(map(tuple, corners)) for corners in found.vertices[found.faces].tolist()
    } == expected


@settings(deadline=None, max_examples=30)
@given(st.sampled_from(["ball", "torus", "creature", "hollow", "pair"]), st.integers(0, 2**32 - 1))
@example("ball", 3461)  # a face with a vertex twice on the long side of one without area
def test_auto_leaves_no_slit(base, seed):
    """A face without area goes and the surface stays closed, whatever else is broken."""
    mesh, rng = BASES[base], np.random.default_rng(seed)
    damages = [
        "slivers",
        *rng.permutation(["soup", "flipped", "duplicates", "loose", "flat", "cut"]),
    ]
    found = repair(build((base, damages, seed)), ["auto"]).mesh
    assert (found.n_vertices, found.n_faces) == (mesh.n_vertices + 1, mesh.n_faces + 2)
    assert is_closed(found)
    assert surface_area(found) == pytest.approx(surface_area(mesh), rel=1e-12)


@pytest.mark.parametrize("base", BASES)
def test_a_sound_mesh_is_left_alone(base):
    mesh = BASES[base]
    assert suggest_repairs(mesh) == ()
    assert repair(mesh, ["auto"]).mesh is mesh
