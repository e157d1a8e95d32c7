"""The report of a collection in a browser: it draws, its sliders bend the mean, and nothing complains."""

import numpy as np
import pytest
from balls import collection_of_balls

from eigenshape.cli import steps
from eigenshape.collections import CarriedLandmarks


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The page of three balls with one landmark, whose correspondence needs no fit."""
    folder = tmp_path_factory.mktemp("balls")
    note = "</script><b>a note</b>"
    collection = collection_of_balls(folder, ("a", "b", "<c>"), level=3, note=note)
    spread = np.full((3, 1), 0.1)
    doubtful = np.array([[False], [False], [True]])
    carried = CarriedLandmarks(
        collection.names,
        ("top",),
        collection.points[:, :1],
        spread,
        doubtful,
        given=np.ones((3, 1), dtype=bool),
        distance=np.zeros((3, 1)),
        disagreement=np.zeros((3, 1)),
        confidence=np.ones((3, 1)),
    )
    path = folder / "report.html"
    steps.write_collection_report(collection, carried, path, "balls", lambda share, name: None)
    return path


def overlap(one, other):
    """Return whether two boxes of the page overlap by a pixel or more."""
    return all(
        min(one[start] + one[size], other[start] + other[size]) - max(one[start], other[start]) > 1
        for start, size in (("x", "width"), ("y", "height"))
    )


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
    assert page.get_by_text("To look at: top.").is_visible()
    # Names of specimens cover neither each other nor points, and are within the picture.
    boxes = [each.bounding_box() for each in page.locator("svg .name, svg circle").all()]
    picture = page.locator("#ordination svg").bounding_box()
    for number, box in enumerate(boxes):
        assert box["x"] > picture["x"] - 1
        assert box["x"] + box["width"] < picture["x"] + picture["width"] + 1
        assert not any(overlap(box, other) for other in boxes[:number])
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
