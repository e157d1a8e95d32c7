"""The report of a collection in a browser: it draws, its sliders bend the mean, and nothing complains."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.collections import CarriedLandmarks, Collection


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The page of three balls with one landmark, whose correspondence needs no fit."""
    folder = tmp_path_factory.mktemp("balls")
    ball = es.icosphere(3)
    sides = np.array([[1.0, 1.7, 0.8], [1.2, 1.5, 0.8], [1.0, 1.4, 1.1]])
    points = ball.vertices * sides[:, None]
    names = ("a", "b", "<c>")
    sources = tuple(folder / f"{number}.ply" for number in range(3))
    for source, own in zip(sources, points, strict=True):
        es.write_mesh(es.TriangleMesh(own, ball.faces), source)
    collection = Collection(
        folder=folder,
        names=names,
        mean=es.TriangleMesh(points.mean(axis=0), ball.faces),
        points=points,
        gaps=np.zeros(points.shape[:2]),
        confidence=np.ones(points.shape[:2]),
        sides=("same", "same", "same"),
        methods=("position", "position", "position"),
        sources=sources,
        template="a",
        notes={"a": (), "b": ("</script><b>a note</b>",), "<c>": ()},
        failures={"d": "it could not be read"},
    )
    spread = np.full((3, 1), 0.1)
    carried = CarriedLandmarks(names, ("top",), points[:, :1], spread, spread > 1)
    path = folder / "report.html"
    steps.write_collection_report(collection, carried, path, "balls", lambda share, name: None)
    return path


@pytest.mark.parametrize("width", [1280, 390])
def test_the_mean_bends_and_nothing_complains(browser, report, width):
    page = browser.new_page(viewport={"width": width, "height": 800})
    lines = []
    page.on("console", lambda message: lines.append(message.text))
    page.on("pageerror", lambda error: lines.append(str(error)))
    page.goto(report.as_uri())
    canvas = page.locator("canvas")
    at_rest = canvas.screenshot()
    assert page.locator("svg circle").count() == 3
    assert page.locator(".sheet img").count() == 3
    assert page.get_by_text("</script><b>a note</b>").count() == 1
    assert page.get_by_text("it could not be read").is_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= width

    page.locator("input[type=range]").first.fill("2")
    bent = canvas.screenshot()
    assert bent != at_rest
    canvas.press("ArrowLeft")
    assert canvas.screenshot() != bent
    page.locator(".sheet button").nth(2).click()
    assert page.locator("#chosen b").inner_text() == "<c>"
    values = page.evaluate("sliders.map((slider) => Number(slider.value))")
    wanted = page.evaluate("data.specimens[2].scores")
    assert np.allclose(values, np.clip(wanted, -3, 3), atol=0.026)
    page.get_by_role("button", name="Mean").click()
    assert page.evaluate("sliders.map((slider) => slider.value)") == ["0", "0"]
    assert lines == []
    page.close()
