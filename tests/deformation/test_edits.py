import json
from dataclasses import asdict

import numpy as np
import pytest
from bent_shapes import lump, lump_rig, tube

from certeig.kit.errors import FileFormatError, InvalidParameterError
from eigenshape.deformation.edits import (
    Edit,
    Move,
    apply_edit,
    carry_edit,
    edits_from_json,
    edits_to_json,
    mesh_fingerprint,
)
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.deformation.region import BoxRegion, BrushRegion, region_mask
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.resolution.subdivision import subdivide

HEAD, TAIL = (lump().vertices[:, 0] > 0.6, lump().vertices[:, 0] < -0.7)
PULL = Translation([0.1, 1 / 3, -2e-17])


def there_and_back(edits, mesh=None):
    text = json.dumps(edits_to_json(edits, mesh or lump()), allow_nan=False)
    return edits_from_json(json.loads(text), mesh or lump())


@pytest.mark.parametrize("seed", range(5))
def test_edits_come_back_to_the_last_digit(seed):
    rng = np.random.default_rng(seed)
    turn = Rotation(rng.standard_normal(3), rng.standard_normal(3), rng.standard_normal())
    edit = Edit(
        (Move(HEAD, turn), Move(np.flatnonzero(TAIL), PULL)),
        n_modes=30,
        mode=["graded", "thesis"][seed % 2],
    )
    (back,) = there_and_back([edit])
    one, two = apply_edit(lump_rig(), edit), apply_edit(lump_rig(), back)
    np.testing.assert_array_equal(one.mesh.vertices, two.mesh.vertices)
    assert (back.n_modes, back.mode, back.fixed) == (30, edit.mode, None)


def test_open_boxes_and_brushes_come_back():
    box, brush = (
        BoxRegion([-np.inf, 0.1, -np.inf], [np.inf, np.inf, 1 / 3]),
        BrushRegion([1, 2, 1 / 3], 0.1),
    )
    (back,) = there_and_back(
        [Edit((Move(box, PULL), Move(brush, PULL)), fixed=BoxRegion([0] * 3, [1] * 3))]
    )
    found = back.moves[0].region
    np.testing.assert_array_equal([found.low, found.high], [box.low, box.high])
    np.testing.assert_array_equal(back.moves[1].region.center, brush.center)
    assert back.moves[1].region.radius == brush.radius
    np.testing.assert_array_equal(back.fixed.high, [1, 1, 1])


@pytest.mark.parametrize(
    "region", [{7, 3}, range(3, 8, 4), [3, 7, 7], (v for v in (7, 3)), np.arange(642) % 642 == 3]
)
def test_any_region_of_vertices_is_kept(region):
    edit = Edit((Move(region, PULL),), fixed=iter([9]))
    (back,) = there_and_back([edit])
    wanted = [3, 7] if not isinstance(region, np.ndarray) else [3]
    for some in (edit, back, carry_edit(edit, lump(), lump())):
        assert np.flatnonzero(region_mask(lump(), some.moves[0].region)).tolist() == wanted
        assert np.flatnonzero(region_mask(lump(), some.fixed)).tolist() == [9]


def test_a_region_of_no_vertex_comes_back_and_is_refused_where_it_bends():
    (back,) = there_and_back([Edit((Move([], PULL),))])
    for edit in (back, carry_edit(back, lump(), lump())):
        with pytest.raises(InvalidParameterError, match="region 0 holds no vertex"):
            apply_edit(lump_rig(), edit)


def test_regions_of_another_mesh_are_refused():
    edit = Edit((Move([641], PULL),))
    for attempt in (
        lambda: edits_to_json([edit], tube()),
        lambda: carry_edit(edit, tube(), lump()),
    ):
        with pytest.raises(
            InvalidParameterError, match=r"A vertex of a region must lie in 0\.\.491; it is 641"
        ):
            attempt()


def test_a_finer_mesh_asks_its_nearest_vertices():
    fine = subdivide(tube())
    rows = np.arange(492) // 12
    box = BoxRegion([0, 0, 0], [1, 1, 1])
    carried = carry_edit(
        Edit((Move(rows >= 30, PULL),), fixed=box, n_modes=9, mode="thesis"), tube(), fine
    )
    mask = carried.moves[0].region
    np.testing.assert_array_equal(mask[:492], rows >= 30)
    height = fine.vertices[:, 2]
    assert mask[height > 4.5].all()
    assert not mask[height < 4.34].any()
    assert (carried.fixed, carried.n_modes, carried.mode) == (box, 9, "thesis")


GOOD = {
    "moves": [
        {
            "region": {"kind": "vertices", "vertices": [1]},
            "handle": {"kind": "translation", "vector": [0, 0, 1]},
        }
    ],
    "fixed": None,
    "n_modes": None,
    "mode": "graded",
}


FIVE = TriangleMesh(np.arange(15.0).reshape(5, 3) ** 2, [[0, 1, 2], [2, 3, 4]])


def content(*edits, **changes):
    return {
        "kind": "eigenshape edits",
        "version": 2,
        "mesh": asdict(mesh_fingerprint(FIVE)),
        "edits": list(edits),
        **changes,
    }


def moving(region=None, handle=None):
    move = GOOD["moves"][0]
    return {
        **GOOD,
        "moves": [{"region": region or move["region"], "handle": handle or move["handle"]}],
    }


def test_what_the_broken_ones_are_made_of_can_be_read():
    assert len(edits_from_json(content(GOOD, moving()), FIVE)) == 2


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (None, "Edit 1 cannot be read"),
        ([], "Edit 1 cannot be read"),
        ({}, "Edit 1 cannot be read: 'moves' is missing or unknown"),
        ({**GOOD, "moves": {}}, "Edit 1 cannot be read: moves must be a list; it is {}"),
        ({**GOOD, "moves": [5]}, "Edit 1 cannot be read"),
        ({**GOOD, "fixed": 5}, "Edit 1 cannot be read"),
        (
            {**GOOD, "mode": "soft"},
            "Edit 1 cannot be read: mode must be 'graded', 'uncrossed' or 'thesis'; it is 'soft'",
        ),
        ({**GOOD, "mode": ["graded"]}, "Edit 1 cannot be read: mode must be"),
        ({**GOOD, "n_modes": 0}, "Edit 1 cannot be read: n_modes must be at least 1; it is 0"),
        (
            {**GOOD, "n_modes": 2.5},
            r"Edit 1 cannot be read: n_modes must be a whole number; it is 2\.5",
        ),
        (
            {**GOOD, "n_modes": True},
            "Edit 1 cannot be read: n_modes must be a whole number; it is True",
        ),
        (moving({"kind": "ball"}), "Edit 1 cannot be read: 'ball' is missing or unknown"),
        (moving({"kind": ["box"]}), "Edit 1 cannot be read"),
        (moving({"kind": "vertices"}), "Edit 1 cannot be read: 'vertices' is missing"),
        (
            moving({"kind": "vertices", "vertices": [5]}),
            r"Edit 1 cannot be read: A vertex must lie in 0\.\.4; it is 5",
        ),
        (
            moving({"kind": "vertices", "vertices": [-1]}),
            r"Edit 1 cannot be read: A vertex must lie in 0\.\.4; it is -1",
        ),
        (
            moving({"kind": "vertices", "vertices": "1"}),
            "Edit 1 cannot be read: vertices must be a list; it is '1'",
        ),
        (
            moving({"kind": "vertices", "vertices": ["1"]}),
            "Edit 1 cannot be read: A vertex must be a whole number",
        ),
        (
            moving({"kind": "box", "low": [0, 0], "high": [1, 1, 1]}),
            "Edit 1 cannot be read: low must be three numbers",
        ),
        (
            moving({"kind": "box", "low": ["0", 0, 0], "high": [1, 1, 1]}),
            "Edit 1 cannot be read: low must be a number",
        ),
        (
            moving({"kind": "box", "low": [10**400, 0, 0], "high": [1, 1, 1]}),
            "Edit 1 cannot be read: .*too large",
        ),
        (
            moving({"kind": "box", "low": [2, 0, 0], "high": [1, 1, 1]}),
            "Edit 1 cannot be read: low must lie below high",
        ),
        (
            moving({"kind": "brush", "center": [0, 0, 0], "radius": -1}),
            "Edit 1 cannot be read: radius must be positive",
        ),
        (
            moving({"kind": "brush", "center": [0, None, 0], "radius": 1}),
            "Edit 1 cannot be read: center must be a number",
        ),
        (moving(handle={"kind": "spin"}), "Edit 1 cannot be read: 'spin' is missing or unknown"),
        (
            moving(handle={"kind": "translation", "vector": [0, 0]}),
            "Edit 1 cannot be read: vector must have three",
        ),
        (
            moving(handle={"kind": "translation", "vector": [0, 0, np.nan]}),
            "Edit 1 cannot be read: vector must be finite",
        ),
        (
            moving(handle={"kind": "rotation", "pivot": [0, 0, 0], "axis": [0, 0, 0], "angle": 1}),
            "Edit 1 cannot be read: axis must have a direction",
        ),
        (
            moving(
                handle={"kind": "rotation", "pivot": [0, 0, 0], "axis": [0, 0, 1], "angle": [1, 2]}
            ),
            r"Edit 1 cannot be read: angle must be a number; it is \[1, 2\]",
        ),
        (
            moving(handle={"kind": "rotation", "pivot": 3, "axis": [0, 0, 1], "angle": 1}),
            "Edit 1 .*pivot must be a list",
        ),
    ],
)
def test_what_is_no_edit_is_refused_by_its_number(broken, message):
    with pytest.raises(FileFormatError, match=message):
        edits_from_json(content(GOOD, broken, GOOD), FIVE)


@pytest.mark.parametrize(
    ("whole", "message"),
    [
        ([], "Edits must be a JSON object of kind 'eigenshape edits'; this is a list"),
        ({"kind": "mesh"}, "Edits must be a JSON object of kind .*; the kind is 'mesh'"),
        (content(GOOD, version=1), "Edits must be of version 2; the version is 1"),
        (
            content(GOOD, mesh={"n_vertices": "5", "n_faces": 2, "digest": ""}),
            "Edit 0 cannot be read: n_vertices must be a whole number; it is '5'",
        ),
        (content(GOOD, mesh={"n_vertices": 5}), "Edit 0 cannot be read: 'n_faces' is missing"),
        (content(GOOD, mesh=None), "Edit 0 cannot be read"),
        (content(GOOD, edits={}), "Edit 0 cannot be read: edits must be a list; it is {}"),
        (
            {"kind": "eigenshape edits", "version": 2, "mesh": content()["mesh"]},
            "Edit 0 cannot be read: 'edits' is missing",
        ),
    ],
)
def test_what_is_no_list_of_edits_is_refused(whole, message):
    with pytest.raises(FileFormatError, match=message):
        edits_from_json(whole, FIVE)
