from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.shape_facts import shape_facts


def test_the_box_is_around_loose_vertices_too():
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-5, 0, 7]], [[0, 1, 2]])
    facts = shape_facts(mesh)
    assert facts["box_low"] == [-5, 0, 0]
    assert facts["box_high"] == [1, 1, 7]
