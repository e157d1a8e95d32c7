"""The page while its server is away: it waits, says so, and goes on with everything that was done."""

import os
import signal
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from browser import (
    find,
    open_page,
    positions,
    region,
    start_server,
    wait_until,
)
from test_browser_company import MAP, attribute
from test_browser_edits import READY, REGION, choose_above, open_file, turn

import eigenshape as es

pytestmark = pytest.mark.long

N_VERTICES = 500
HEAD = 0.4
DONE = "eigenshape.state.history"
STATUS = "eigenshape.main.querySelector('[data-test=status]').textContent"


def test_work_goes_on_after_the_server_was_killed(browser, path, tmp_path):
    """On the same port, with a new token; the page is loaded again, too."""
    with start_server(path, sessions=tmp_path) as (url, number):
        port = int(url.split(":")[2].split("/")[0])
        with open_page(browser, url, expected=("403", "ERR_CONNECTION")) as page:
            wait_until(page, READY)
            chosen = choose_above(page, HEAD)
            turn(page, 40)
            bent = positions(page)
            os.kill(number, signal.SIGKILL)
            find(page, "clear").click()
            wait_until(page, f"{STATUS}.includes('does not answer')")
            with start_server(path, port=port, sessions=tmp_path) as (anew, _):
                wait_until(page, f"{STATUS}.includes('was started anew')")
                other = page.context.new_page()
                other.goto(anew)  # sets the cookie of the new token
                wait_until(page, f"{STATUS}.includes('nothing was lost')")
                assert len(region(page)) == 0
                page.reload()
                wait_until(page, "window.eigenshape?.viewer.vertices.length > 0")
                np.testing.assert_array_equal(positions(page), bent)
                done = ["Box: region 1", "Box: region 1", "Bend", "Clear: region 1"]
                assert page.evaluate(DONE) == done
                wait_until(page, READY)
                page.keyboard.press("Control+z")
                wait_until(page, f"{REGION}.length > 0")
                np.testing.assert_array_equal(region(page), chosen)


def test_a_network_that_is_cut_ten_times_loses_nothing(browser, url):
    with open_page(browser, url, expected=("ERR_INTERNET_DISCONNECTED",)) as page:
        wait_until(page, READY)
        for number in range(10):
            page.context.set_offline(True)
            if number % 2:
                find(page, "clear").click()
            else:
                choose_above(page, HEAD + 0.02 * number, wait=lambda _: None)
            page.context.set_offline(False)
        # Choosing the box is a box, too.
        wait_until(page, "eigenshape.state.history.length === 15")
        wait_until(page, f"{STATUS}.includes('nothing was lost')")
        assert len(region(page)) == 0
        page.keyboard.press("Control+z")
        wait_until(page, "eigenshape.state.place === 14")
        wait_until(page, f"{REGION}.length > 0")


def test_two_browsers_with_two_shapes_do_not_meet(browser, url, path, tmp_path):
    es.write_mesh(es.icosphere(2), tmp_path / "ball.ply")
    with open_page(browser, url) as one, open_page(browser, url) as two:
        for page in (one, two):
            wait_until(page, READY)
        find(two, "tab-shape").click()
        open_file(two, "open", tmp_path / "ball.ply")
        wait_until(two, f"eigenshape.state.name === 'ball.ply' && {READY}")
        find(two, "tab-deform").click()
        first, second = choose_above(one, HEAD), choose_above(two, 0.5)
        turn(one, 30)
        turn(two, 60)
        done = [page.evaluate(DONE) for page in (one, two)]
        assert [len(each) for each in done] == [3, 4]  # choosing the box is a box, too
        for page, chosen in ((one, first), (two, second)):
            page.reload()
            wait_until(page, f"window.eigenshape?.viewer.vertices.length > 0 && {READY}")
            wait_until(page, f"{REGION}.length > 0")
            np.testing.assert_array_equal(region(page), chosen)
        assert [page.evaluate(DONE) for page in (one, two)] == done


def test_a_map_and_its_colors_are_kept_or_said_to_be_gone(browser, tmp_path):
    for pose in (0, 1):
        mesh = es.make_creature("quadruped", pose, n_vertices=N_VERTICES)
        es.write_mesh(mesh, tmp_path / f"{pose}.ply")
    sessions = tmp_path / "sessions"
    with start_server(tmp_path / "0.ply", sessions=sessions) as (url, first):
        port = int(url.split(":")[2].split("/")[0])
        # 400: what a page asks of a server that was started anew may not be computed there yet.
        with open_page(browser, url, expected=("403", "400", "ERR_CONNECTION")) as page:
            find(page, "tab-compare").click()
            open_file(page, "second-file", tmp_path / "1.ply")
            wait_until(page, f"{MAP} !== null")
            marks = [attribute(page, "mark", side) for side in (0, 1)]
            assert all(each.any() for each in marks)
            os.kill(first, signal.SIGKILL)
            page.evaluate("void eigenshape.refresh()")
            with start_server(tmp_path / "0.ply", port=port, sessions=sessions) as (anew, second):
                page.context.new_page().goto(anew)
                wait_until(page, f"{STATUS}.includes('nothing was lost')")
                wait_until(page, "eigenshape.state.beside.map.status === 'ready'")
                wait_until(page, READY)
                for side in (0, 1):
                    np.testing.assert_array_equal(attribute(page, "mark", side), marks[side])
                page.reload()
                wait_until(page, f"window.eigenshape?.panels && {MAP} !== null")
                np.testing.assert_array_equal(attribute(page, "mark", 1), marks[1])
                os.kill(second, signal.SIGKILL)
            (session,) = sessions.glob("*.sqlite")
            with closing(sqlite3.connect(session)) as database:
                database.execute("DELETE FROM maps")
                database.commit()
            page.evaluate("void eigenshape.refresh()")
            with start_server(tmp_path / "0.ply", port=port, sessions=sessions) as (anew, _):
                page.context.new_page().goto(anew)
                wait_until(page, f"{STATUS}.includes('The map to 1.ply is gone')")
                assert page.evaluate(MAP) is None
                assert not any(attribute(page, "mark", side).any() for side in (0, 1))
                assert find(page, "find-map").is_visible()
