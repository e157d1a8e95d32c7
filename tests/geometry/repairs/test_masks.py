"""Parts of a surface that a mask keeps, and values put back."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape import InvalidParameterError
from eigenshape.geometry import mask_surface, unmask

GRID = es.shapes.grid(4, 2)  # 5 by 3 vertices


def test_a_part_and_its_map_back():
    mask = GRID.vertices[:, 0] < GRID.vertices[:, 0].max() * 0.6
    part = mask_surface(GRID, mask)
    assert np.array_equal(part.source_vertices, np.flatnonzero(mask))
    assert np.array_equal(part.mesh.vertices, GRID.vertices[mask])
    assert part.mesh.n_faces == 8
    assert part.report == ("mask_surface left out 6 vertices of 15",)
    assert np.array_equal(mask_surface(GRID, mask.astype(int)).mesh.faces, part.mesh.faces)
    back = unmask(part.mesh.vertices, part.source_vertices, 15)
    assert np.array_equal(back[mask], GRID.vertices[mask])
    assert np.isnan(back[~mask]).all()
    # A mask that keeps everything changes nothing.
    assert np.array_equal(mask_surface(GRID, np.ones(15)).mesh.faces, GRID.faces)


def test_the_border_is_free_or_held():
    part = mask_surface(GRID, GRID.vertices[:, 0] < 0.8).mesh
    laplacian = es.cotangent_laplacian(part)
    assert es.solve_spectrum(laplacian, 1).eigenvalues[0] < 1e-12
    held = es.solve_spectrum(laplacian, 1, fixed=es.geometry.boundary_vertices(part))
    assert held.eigenvalues[0] > 1


def test_what_a_mask_breaks_is_told():
    middle = np.isclose(GRID.vertices[:, 0], np.median(GRID.vertices[:, 0]))
    with pytest.warns(UserWarning, match=r"cuts the surface into 2 pieces, of \[6, 6\] vertices"):
        part = mask_surface(GRID, ~middle)
    assert part.report[1].startswith("the mask cuts the surface into 2 pieces")
    assert es.repair(part.mesh, ["largest_component"]).mesh.n_vertices == 6
    lonely = GRID.vertices[:, 0] < 0.4
    lonely[-1] = True
    assert mask_surface(GRID, lonely).report[1] == "1 vertex of the mask had no face there"
    # Two pieces that were there before are no cut.
    two = es.geometry.disjoint_union(GRID, GRID)
    assert len(mask_surface(two, np.ones(30)).report) == 1


@pytest.mark.parametrize(
    ("mask", "message"),
    [
        (np.ones(14), r"one number per vertex, shape \(15,\); the shape is \(14,\)"),
        (np.full(15, np.nan), "mask must be finite; entry 0 is nan"),
        (np.full(15, 0.5), "True or False, or 1 or 0, for each vertex; that of vertex 0 is 0.5"),
        (np.arange(15), "that of vertex 2 is 2"),
        (np.zeros(15), "keep at least one face; it keeps 0 of 15"),
        (np.arange(15) < 1, "keep at least one face; it keeps 1 of 15"),
    ],
)
def test_a_bad_mask_is_named(mask, message):
    with pytest.raises(InvalidParameterError, match=message):
        mask_surface(GRID, mask)


def test_bad_values_on_a_part_are_named():
    with pytest.raises(InvalidParameterError, match="one row for each of 2 vertices; the shape is"):
        unmask([1.0], [0, 1], 4)
    with pytest.raises(InvalidParameterError, match="A vertex must lie in"):
        unmask([1.0], [4], 4)
    with pytest.raises(es.InvalidParameterError, match="must fit into memory; n_vertices is 1000"):
        unmask([1.0], [0], 10**15)
