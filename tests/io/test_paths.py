"""Paths that the system cannot open are refused by name, wherever one is taken."""

import pytest

import eigenshape as es
from certeig.kit.files import as_path
from eigenshape.plot.figure import Figure


@pytest.mark.parametrize(
    "call",
    [
        es.read_mesh,
        es.read_shape,
        es.io.read_points,
        es.io.read_surface,
        es.io.read_labeled_shape,
        es.Spectrum.load,
        es.ShapeIndex.open,
        lambda path: es.write_mesh(es.icosphere(0), path),
        lambda path: es.io.write_edits([], es.icosphere(0), path),
        lambda path: es.io.read_edits(path, es.icosphere(0)),
        lambda path: es.save_figure(Figure(1.0, 1.0), path),
        lambda path: es.solve_spectrum(es.cotangent_laplacian(es.icosphere(0)), 2, cache=path),
    ],
)
def test_a_path_is_text_without_nul(call):
    with pytest.raises(es.InvalidParameterError, match=r"must not hold the character NUL; 'a\\x00"):
        call("a\0b.ply")


def test_a_path_that_is_no_text_is_named():
    for value, kind in ((None, "None"), (b"a.ply", "a bytes"), (3, r"an int \(3\)")):
        with pytest.raises(es.InvalidParameterError, match=f"path must be a str or .* is {kind}"):
            as_path(value)
