"""The unit sphere by eight operators (Figure 3.2): what the README claims."""

import pytest


@pytest.mark.long
def test_claims_about_operators_on_the_sphere(quick_form):
    found = quick_form("ch3_sphere/run.py")
    operators, noise = found["operators"], found["noise"]

    def medians(name, what):
        return [row[what][0] for size, row in operators[name].items() if size != "order"]

    # the printed form is far too low, and the corrected one is not
    assert medians("mesh, literal", "values")[-1] > 0.15
    assert medians("mesh, corrected", "values")[-1] < 0.01
    # the correction leaves eigenvectors as they are
    assert medians("mesh, corrected", "vectors") == pytest.approx(
        medians("mesh, literal", "vectors"), rel=1e-3
    )
    # only the random-walk form bears noise
    assert noise["mesh, random-walk"][0] < 0.03
    assert min(noise["cotangent, lumped"][0], noise["mesh, corrected"][0]) > 0.2
    # linear elements have order two
    assert operators["cotangent, lumped"]["order"]["values"] == pytest.approx(2, abs=0.25)
    # uneven weights are what turns eigenspaces of the mesh Laplacian
    for of_triangles, of_cells in found["scatter"]:
        assert of_triangles > 5 * of_cells
    for name in ("mesh, literal", "mesh, corrected", "mesh, random-walk"):
        for mesh, points in zip(
            medians(name, "vectors"), medians("points, corrected", "vectors"), strict=True
        ):
            assert mesh > 5 * points
