"""Every figure: seen in notebooks, and safe whatever its text."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

import eigenshape as es
from certeig.kit.text import literal
from eigenshape.plot.figure import Figure

EVIL = "a\x1b[31mb\x07c\u202ed\x00e"
BALL = es.icosphere(1)
LABELS = np.arange(BALL.n_faces) % 2


def figures(title):
    spectra = {title: np.arange(1.0, 5), "other": np.arange(1.0, 5)}
    yield es.figure_field(BALL, BALL.vertices[:, 0], title)
    yield es.plot.figure_poses({title: BALL})
    yield es.plot.figure_spectra(spectra)
    yield es.plot.figure_contact_sheet(
        es.plot.Panel(BALL, title, LABELS, np.array([0])), [], caption=title
    )
    yield es.plot.figure_merge_tree(es.merge_tree(BALL, BALL.vertices[:, 0]), label=title)


@pytest.mark.long
def test_notebooks_show_the_picture():
    """IPython asks an object for `_repr_png_` where nobody has told it of the type."""
    every = [
        *figures("plain"),
        es.figure_segments(BALL, LABELS, np.array([0])),
        es.plot.figure_spectrum(es.solve_spectrum(es.cotangent_laplacian(BALL), 5)),
    ]
    for figure in every:
        assert isinstance(figure, Figure)
        assert figure._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.long
@pytest.mark.parametrize("number", range(5))
def test_control_characters_break_no_picture(tmp_path, number):
    path = tmp_path / "a.svg"
    es.save_figure(list(figures(EVIL))[number], path)
    ET.parse(path)
    text = path.read_text()
    assert r"a\x1b[31mb\x07c\u202ed\x00e" in text
    assert not any(letter in text for letter in EVIL if not letter.isprintable())


@pytest.mark.long
def test_a_line_of_a_title_ends_where_it_did():
    figure = es.plot.figure_poses({"one\ntwo": BALL})
    figure._repr_png_()
    assert figure.axes[0].get_title() == "one\ntwo"


@pytest.mark.long
@pytest.mark.parametrize("name", ["a$b$.ply", "$x_", r"$\frac{$", r"a\$b", "$$", "plain"])
def test_a_name_is_shown_letter_by_letter(tmp_path, name):
    es.save_figure(es.plot.figure_poses({literal(name): BALL}), tmp_path / "a.svg")
    assert f"<!-- {name} -->" in (tmp_path / "a.svg").read_text()
