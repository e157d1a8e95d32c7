"""Values print themselves in one line that names what they hold."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape._text import LONGEST

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
