"""The image on a shape, in a real browser."""

from io import BytesIO

import numpy as np
import pytest
from browser import (
    drop_file,
    find,
    open_page,
    picture,
    serve_studio,
    wait_until,
    wait_until_still,
)
from PIL import Image
from scipy.sparse import eye_array

import eigenshape as es

pytestmark = pytest.mark.long
N_VERTICES = 1500
SHOWN = "eigenshape.viewer.surface.skin?.visible"


def write_painted(folder, suffix):
    """Write a ball whose upper half is blue and lower half green, by an image of two rows of pixels."""
    pixels = np.array([[[0, 0, 255]] * 2, [[0, 255, 0]] * 2], dtype=np.uint8)
    data = BytesIO()
    Image.fromarray(pixels).save(data, "PNG")
    ball = es.icosphere(3)
    none = np.full(ball.n_faces, -1)
    heights = ball.vertices[ball.faces][:, :, 1]
    attributes = es.io.MeshAttributes(
        ball,
        eye_array(3 * ball.n_faces, format="csr"),
        none + 1,
        none + 1,
        none,
        # In the middle of a row of pixels; u goes twice around: the image is repeated.
        texture_coordinates=np.stack(
            [
                heights * 2,
                np.where(heights.mean(axis=1, keepdims=True) > 0, 0.75, 0.25) + 0 * heights,
            ],
            axis=2,
        ),
        materials=(es.io.Material("skin", image=data.getvalue(), image_name="skin.png"),),
    )
    path = folder / f"ball{suffix}"
    es.write_mesh(ball, path, attributes=attributes)
    return path


def hues(page):
    """Return the mean color of the upper and of the lower half of the shape on the canvas."""
    seen = picture(page).astype(float)
    drawn = seen[:, :, 3] == 255
    rows = np.flatnonzero(drawn.any(axis=1))
    top, end = rows.min(), rows.max()
    height = end - top
    bands = (top + height // 10, top + height // 3), (end - height // 3, end - height // 10)
    columns = slice(seen.shape[1] // 2 - 30, seen.shape[1] // 2 + 30)
    return [seen[slice(*band), columns, :3].mean(axis=(0, 1)) for band in bands]


@pytest.mark.parametrize("suffix", [".obj", ".glb"])
def test_the_image_is_seen_the_right_way_up_until_a_result_colors_the_shape(
    browser, tmp_path, suffix
):
    with serve_studio(write_painted(tmp_path, suffix)) as url, open_page(browser, url) as page:
        wait_until(page, SHOWN)
        upper, lower = hues(page)
        assert upper[2] > 2 * max(upper[:2])  # blue: the first row of the file
        assert lower[1] > 2 * max(lower[0], lower[2])
        find(page, "texture").click()
        assert not page.evaluate(SHOWN)
        plain = hues(page)
        assert max(np.ptp(color) for color in plain) < 30
        find(page, "texture").click()
        assert page.evaluate(SHOWN)
        find(page, "tab-heat").click()
        wait_until(page, f"!({SHOWN})")
        find(page, "tab-deform").click()
        wait_until(page, SHOWN)


def test_a_bent_shape_wears_its_image(browser, tmp_path):
    with serve_studio(write_painted(tmp_path, ".glb")) as url, open_page(browser, url) as page:
        wait_until(page, SHOWN)
        page.evaluate(
            "eigenshape.viewer.setVertices(eigenshape.viewer.vertices.map((x, i) => (i % 3 ? x : 2 * x)))"
        )
        code = (
            """Array.from(eigenshape.viewer.surface.skin.geometry.getAttribute("position").array)"""
        )
        places = np.array(page.evaluate(code)).reshape(-1, 3)
        assert np.abs(places[:, 0]).max() == pytest.approx(2, abs=1e-6)
        assert np.abs(places[:, 1]).max() == pytest.approx(1, abs=1e-6)


def test_only_a_shape_with_a_look_has_the_button(page, tmp_path):
    assert find(page, "texture").is_hidden()
    ball = es.icosphere(2)
    text = "\n".join(f"v {x} {y} {z} {y * 0 + 0.2} 0.9 0.1" for x, y, z in ball.vertices.tolist())
    faces = "\n".join("f " + " ".join(map(str, face)) for face in (ball.faces + 1).tolist())
    (tmp_path / "ball.obj").write_text(f"{text}\n{faces}\n")
    # What is asked of a shape that is replaced is answered by an error.
    wait_until_still(page)
    drop_file(page, "stage", tmp_path / "ball.obj")
    wait_until(page, SHOWN)
    assert find(page, "texture").is_visible()
    upper, lower = hues(page)
    assert min(upper[1] / max(upper[0], upper[2]), lower[1] / max(lower[0], lower[2])) > 2
