"""Values print themselves in one line that names what they hold."""

import base64
import dataclasses
import inspect
import re
from pathlib import Path

import numpy as np
import pytest
from public_names import public_things
from sklearn.base import BaseEstimator  # prints and draws estimators itself

import eigenshape as es
from certeig.kit.text import LONGEST, html_repr, repr_of_changes, short_repr

CLASSES = [
    thing
    for thing in public_things().values()
    if inspect.isclass(thing) and not issubclass(thing, (Exception, BaseEstimator))
]
BALL = es.icosphere(2)
SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(BALL), 9)
VALUES = {
    "Laplacian": lambda: es.cotangent_laplacian(BALL),
    "Spectrum": lambda: SPECTRUM,
    "Certificate": lambda: SPECTRUM.certificate,
    "MergeTree": lambda: es.merge_tree(BALL, BALL.vertices[:, 2]),
    "Segmentation": lambda: es.segment(es.merge_tree(BALL, BALL.vertices[:, 2]), n_regions=1),
    "MeshPart": lambda: es.partial_scan(BALL, [0, 0, 1]),
    "EigenRig": lambda: es.rig_shape(BALL, SPECTRUM),
    "Move": lambda: es.deformation.Move(np.arange(80), es.Translation([0, 0, 1])),
}


@pytest.mark.parametrize("name", VALUES)
def test_a_value_is_printed_in_one_line_without_its_large_arrays(name):
    text = repr(VALUES[name]())
    assert text.startswith(f"{name}(")
    assert "\n" not in text
    entries = text.count("=")
    assert len(text) < entries * (LONGEST + 30)


def test_short_entries_stand_in_full_and_long_ones_with_their_shape():
    text = repr(SPECTRUM)
    assert "eigenvectors=<float64 (162, 9)>" in text
    assert text.endswith("certificate=Certificate(...))")
    tree = es.merge_tree(BALL, BALL.vertices[:, 2])
    assert "persistence=array([inf])" in repr(tree)
    assert "basins=<int64 (320,)>" in repr(tree)


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_every_value_has_a_table_for_notebooks_and_a_short_text(kind):
    assert kind._repr_html_.__qualname__ == html_repr.__qualname__
    made = kind.__repr__
    short = (short_repr.__qualname__, repr_of_changes.__qualname__)
    assert made.__qualname__ in (*short, f"{kind.__name__}.__repr__")
    # What dataclasses generate prints arrays in full, so it is for a few numbers and texts alone.
    if inspect.unwrap(made).__code__.co_filename == "<string>":
        assert len(dataclasses.fields(kind)) <= 10
        assert not [field.name for field in dataclasses.fields(kind) if is_long(field.type)]


def is_long(annotation):
    """Say whether a field of this type may hold an array of more than a few numbers."""
    dims = getattr(annotation, "dim_str", "3")
    return not dims.replace(" ", "").isdigit()


@pytest.mark.parametrize("name", VALUES)
def test_the_table_of_a_value_has_a_short_row_for_each_field(name):
    value = VALUES[name]()
    first, title, *rows, last = value._repr_html_().split("\n")
    assert first == "<table>"
    assert last.startswith("</table>")  # a picture may follow
    assert title == f"<caption>{name}</caption>"
    assert len(rows) == len(dataclasses.fields(value))
    assert max(map(len, rows)) < 2 * LONGEST + 60


def test_a_mesh_shows_its_counts_and_a_small_picture():
    text = BALL._repr_html_()
    assert "162 vertices, 320 faces" in text
    picture = base64.b64decode(re.search(r'src="data:image/png;base64,([^"]+)"', text)[1])
    assert picture == es.retrieval.draw_thumbnail(BALL)


def test_a_mesh_that_takes_long_to_draw_shows_its_counts_alone(monkeypatch):
    monkeypatch.setattr("eigenshape.geometry.mesh.MOST_DRAWN", 319)
    text = BALL._repr_html_()
    assert "162 vertices, 320 faces" in text
    assert "<img" not in text


def test_a_spectrum_shows_a_dot_for_each_eigenvalue_and_what_is_proved():
    text = SPECTRUM._repr_html_()
    heights = [float(y) for y in re.findall(r'<circle cx="[\d.]+" cy="([\d.]+)"', text)]
    assert heights[0] == 110
    assert heights[-1] == 10
    expected = 110 - 100 * SPECTRUM.eigenvalues / SPECTRUM.eigenvalues[-1]
    np.testing.assert_allclose(heights, expected, atol=0.051)
    assert SPECTRUM.certificate.explain() in text


def test_a_spectrum_of_zeros_alone_has_a_plot():
    only = es.solve_spectrum(es.cotangent_laplacian(BALL), 1)
    assert '<circle cx="10.0"' in only._repr_html_()


def test_an_index_shows_its_first_shapes_and_how_many_there_are():
    index = es.ShapeIndex.create(None)
    described = es.describe(BALL, es.retrieval.SCALE_FREE)
    names = [f"<ball {number}>" for number in range(12)]
    index.add_many([es.retrieval.DescribedShape(name, [described]) for name in names])
    text = index._repr_html_()
    assert "<caption>12 shapes</caption>" in text
    assert [f"&lt;ball {number}&gt;" in text for number in range(12)] == [True] * 10 + [False] * 2
    assert "and 2 more" in text


def test_an_index_that_is_gone_shows_its_folder_alone(tmp_path):
    index = es.ShapeIndex.create(tmp_path / "index")
    (tmp_path / "index" / "index.sqlite").unlink()
    text = index._repr_html_()
    assert text.endswith("</table>")
    assert str(index.folder) in text or "PosixPath" in text


def test_text_in_a_table_is_escaped():
    item = es.retrieval.Item("<script>", Path("a.ply"))
    assert "&lt;script&gt;" in item._repr_html_()
    assert "<script>" not in item._repr_html_()


def test_a_session_says_how_many_edits_it_has():
    session = es.DeformationSession(es.rig_shape(BALL, SPECTRUM))
    text = "DeformationSession(TriangleMesh(162 vertices, 320 faces), 0 edits, 0 to redo)"
    assert repr(session) == text
    assert session._repr_html_() == f"<code>{text}</code>"
