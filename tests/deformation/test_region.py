import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape.deformation.region import (
    BoxRegion,
    BrushRegion,
    copy_region,
    region_boundary,
    region_mask,
    require_boundary,
)
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.shapes.surfaces import grid, icosphere

GRID = grid(4, 4, width=4.0, height=4.0)  # vertex 5 x + y


def chosen(region, mesh=GRID):
    return np.flatnonzero(region_mask(mesh, region)).tolist()


def test_masks_and_indices_hold_what_they_say():
    mask = np.arange(25) % 7 == 3
    assert chosen(mask) == [3, 10, 17, 24]
    assert chosen(mask.tolist()) == [3, 10, 17, 24]
    assert chosen([24, 3, 3, 10]) == [3, 10, 24]
    assert chosen(np.array([7], dtype=np.uint8)) == [7]
    assert chosen(index for index in (1, 2)) == [1, 2]
    assert chosen([]) == []


def test_a_box_holds_what_lies_in_it_and_on_it():
    assert chosen(BoxRegion([1, 1, 0], [2, 3, 0])) == [6, 7, 8, 11, 12, 13]
    assert chosen(BoxRegion([3.5, -np.inf, -np.inf], [np.inf] * 3)) == [20, 21, 22, 23, 24]
    assert chosen(BoxRegion([0, 0, 1], [9, 9, 9])) == []


def test_a_brush_reaches_as_far_along_the_surface():
    assert chosen(BrushRegion([2.2, 1.9, 0.3], 1.0)) == [7, 11, 12, 13, 17]
    assert chosen(BrushRegion([2, 2, 0], 1.4)) == [7, 11, 12, 13, 17]
    assert chosen(BrushRegion([2, 2, 0], 1.42)) == [6, 7, 8, 11, 12, 13, 16, 17, 18]


def test_a_brush_does_not_jump_to_a_near_sheet():
    sheet = grid(8, 8)
    folded = np.array([[x, y, 0.0] if x <= 0.5 else [1 - x, y, 0.01] for x, y, _ in sheet.vertices])
    mesh = TriangleMesh(folded, sheet.faces)
    below, above = 1 * 9 + 4, 7 * 9 + 4  # opposite each other, .01 apart, .75 along the sheet
    held = chosen(BrushRegion(folded[below], 0.4), mesh)
    assert below in held
    assert above not in held
    assert above in chosen(BoxRegion(folded[below] - 0.1, folded[below] + 0.1), mesh)


def test_the_boundary_of_a_square_is_its_ring():
    square = region_mask(GRID, BoxRegion([1, 1, 0], [3, 3, 0]))
    assert region_boundary(GRID, square).tolist() == [6, 7, 8, 11, 13, 16, 17, 18]
    assert region_boundary(GRID, ~square).tolist() == [
        *(
            0,
            1,
            2,
            3,
            5,
            9,
            10,
            14,
            15,
            19,
            21,
            22,
            23,
            24,
        )  # not 4 and 20: no diagonal leads from there inside
    ]


def test_along_the_rim_of_the_surface_there_is_no_boundary():
    left = region_mask(GRID, BoxRegion([0, 0, 0], [1, 4, 0]))
    assert region_boundary(GRID, left).tolist() == [5, 6, 7, 8, 9]
    assert require_boundary(GRID, left, 0).tolist() == [5, 6, 7, 8, 9]


def test_regions_without_a_boundary_are_refused():
    mesh = disjoint_union(icosphere(0), icosphere(1))
    for mask, what in (
        (
            np.zeros(54, dtype=bool),
            "region 2 holds no vertex, and the shape lies from -.* to .* in x",
        ),
        (np.ones(54, dtype=bool), "region 2 holds 54 of 54 vertices, whole components"),
        (np.arange(54) < 12, "region 2 holds 12 of 54 vertices, whole components"),
    ):
        with pytest.raises(
            InvalidParameterError, match=f"A region must have a boundary on the shape.*{what}"
        ):
            require_boundary(mesh, mask, 2)


def test_bad_regions_are_refused_by_name():
    with pytest.raises(
        InvalidParameterError,
        match=r"A mask must have one entry per vertex, shape \(25,\); .* \(24,\)",
    ):
        region_mask(GRID, np.ones(24, dtype=bool))
    with pytest.raises(
        InvalidParameterError, match=r"A vertex of a region must lie in 0\.\.24; it is 25"
    ):
        region_mask(GRID, [3, 25])
    with pytest.raises(
        InvalidParameterError, match=r"low must lie below high; along axis 1 they are 2\.0 and 1\.0"
    ):
        BoxRegion([0, 2, 0], [1, 1, 1])
    with pytest.raises(
        InvalidParameterError, match=r"high must be three numbers; it is \[1\.0, nan, 1\.0\]"
    ):
        BoxRegion([0, 0, 0], [1, np.nan, 1])
    with pytest.raises(InvalidParameterError, match="radius must be positive and finite"):
        BrushRegion([0, 0, 0], 0.0)


def test_a_kept_region_is_its_own():
    mask = np.zeros(25, dtype=bool)
    kept = copy_region(mask)
    mask[:] = True
    assert chosen(kept) == []
    assert chosen(copy_region(index for index in (1, 2))) == [1, 2]
    box = BoxRegion([0, 0, 0], [1, 1, 1])
    assert copy_region(box) is box


def test_a_boundary_needs_an_entry_for_each_vertex():
    with pytest.raises(InvalidParameterError, match="A mask must have one entry per vertex"):
        region_boundary(GRID, np.ones(1, dtype=bool))
