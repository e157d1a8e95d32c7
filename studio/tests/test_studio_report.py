"""A report is one file that holds everything, and nothing that is loaded from elsewhere."""

import base64
import gzip
import re

import numpy as np
import pytest
from conftest import stretched_ball

import eigenshape as es
from eigenshape_studio.report import write_report
from eigenshape_studio.wire import decode


def contents(path):
    page = path.read_text()
    data = re.search(r'<script id="eigenshape-data"[^>]*>([^<]*)</script>', page)
    return page, *decode(gzip.decompress(base64.b64decode(data[1])))


def test_a_report_holds_the_state_and_all_arrays(tmp_path):
    mesh = stretched_ball()
    path = tmp_path / "ball.html"
    steps = []
    write_report(
        mesh,
        path,
        name="<ball>.ply",
        values={"height (m)": mesh.vertices[:, 2]},
        n_modes=8,
        progress=lambda *step: steps.append(step),
    )
    page, state, arrays = contents(path)
    assert "<title>&lt;ball&gt;.ply</title>" in page
    assert state["capabilities"] == []
    assert state["name"] == "<ball>.ply"
    assert state["spectrum"]["k"] == 8
    assert (state["parts"]["status"], state["health"]["status"]) == ("ready", "ready")
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 8)
    np.testing.assert_array_equal(arrays["eigenvalues"], spectrum.eigenvalues)
    largest = np.abs(spectrum.eigenvectors).max()
    assert np.abs(arrays["modes"] - spectrum.eigenvectors.T).max() < 5e-4 * largest
    np.testing.assert_array_equal(arrays["vertices"], mesh.vertices.astype("<f4"))
    np.testing.assert_array_equal(arrays["faces"], mesh.faces)
    assert {"areas", "diagram", "parts/labels", "parts/cuts"} <= arrays.keys()
    assert f"values/{state['values'][0]['name']}" in arrays
    assert list(tmp_path.iterdir()) == [path]
    beside = tmp_path / "usual"
    beside.touch()
    assert path.stat().st_mode == beside.stat().st_mode  # a web server may read it as any file


def test_a_report_loads_nothing_from_elsewhere(tmp_path):
    write_report(stretched_ball(1), tmp_path / "a.html", n_modes=4)
    page = (tmp_path / "a.html").read_text()
    assert page.count("<script") == 2 + page.count("<script", page.index('type="module">') + 14)
    head = page[: page.index("<body>")]
    assert "default-src 'none'" in head
    assert not re.findall(r'(?:src|href)="(?!data:,)', head)


def test_a_shape_without_a_spectrum_has_no_report(tmp_path):
    flat = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    with pytest.raises(es.InvalidShapeError):
        write_report(flat, tmp_path / "a.html")
    assert not list(tmp_path.iterdir())
