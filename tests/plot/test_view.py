import sys
from types import ModuleType

import numpy as np
import pytest

import eigenshape as es


@pytest.fixture
def widgets(monkeypatch):
    """Put a module in the place of the studio's, which the library's tests do not need."""
    made = []

    def make(mesh, fields, *, height):
        made.append((mesh, fields, height))
        return "a widget"

    monkeypatch.setitem(sys.modules, "eigenshape_studio", ModuleType("eigenshape_studio"))
    module = ModuleType("eigenshape_studio.widget")
    monkeypatch.setattr(module, "ShapeWidget", make, raising=False)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return made


def test_view_hands_the_shape_and_its_values_to_the_widget(widgets):
    mesh = es.icosphere(1)
    height = mesh.vertices[:, 2]
    assert es.view((mesh.vertices, mesh.faces), {"height (m)": height}) == "a widget"
    es.view(mesh, height, height=300)
    es.view(mesh)
    (first, named, size), (_, alone, small), (_, none, _) = widgets
    assert isinstance(first, es.TriangleMesh)
    assert (list(named), size) == (["height (m)"], 640)
    np.testing.assert_array_equal(alone["values"], height)
    assert (small, none) == (300, {})


@pytest.mark.parametrize("missing", ["eigenshape_studio", "eigenshape_studio.widget"])
def test_without_the_studio_view_says_what_to_install(monkeypatch, missing):
    monkeypatch.delitem(sys.modules, "eigenshape_studio.widget", raising=False)
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(es.MissingExtraError, match=r"pip install 'eigenshape-studio\[notebook\]'"):
        es.view(es.icosphere(1))


def test_view_passes_the_side_on_to_the_widget(widgets, monkeypatch):
    sides = []

    class Widget:
        def __init__(self, *_, **__):
            pass

        def look_from(self, view, up):
            sides.append((view, up))

    monkeypatch.setattr(sys.modules["eigenshape_studio.widget"], "ShapeWidget", Widget)
    es.view(es.icosphere(1))
    es.view(es.icosphere(1), view="left", up="-z")
    assert sides == [("left", "-z")]
