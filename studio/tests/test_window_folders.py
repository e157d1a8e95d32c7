"""Folders, indexes and collections that are opened from the window."""

import json

import numpy as np
import pytest
from test_company import collection  # noqa: F401  a fixture
from test_studio_opening import folder, index  # noqa: F401  fixtures
from test_workspace import Page

import eigenshape as es
from eigenshape_studio.opening import open_workspace
from eigenshape_studio.others.folders import Folders
from eigenshape_studio.tab.sessions import SessionFile


@pytest.fixture
def first():
    workspace = open_workspace()
    yield workspace
    workspace.close()


def tab(workspace, root, file=None):
    """Return the page of a new tab that may open the folders in `root`."""
    workspace.folders = Folders(root)
    return Page(workspace.fork(file))


def test_a_page_lists_what_is_in_a_folder(first, folder, index):  # noqa: F811
    root = folder.parent
    page = tab(first, root)
    found = json.loads(page.array("folder/.").tobytes())
    assert found["path"] == str(root)
    assert [folder.name, "folder"] in found["folders"]
    assert [index.name, "index"] in found["folders"]
    assert json.loads(page.array(f"folder/{folder.name}").tobytes())["n_files"] == 3


def test_the_shapes_of_a_folder_join_the_list_and_can_be_undone(first, folder):  # noqa: F811
    page = tab(first, folder.parent)
    for _ in range(2):  # the second time they are in the list
        state = page.call("finish", kind="folder", folder=folder.name)[0]["state"]
        assert [name for _, name in state["shapes"]] == ["quadruped", "a", "b", "c"]
        assert (state["name"], state["n_vertices"]) == ("a", 12)
    for _ in range(2):
        state = page.call("finish", kind="undo")[0]["state"]
    assert state["name"] == "quadruped"


def test_an_opened_index_is_searched_also_after_a_restart(first, index, tmp_path):  # noqa: F811
    file = tmp_path / "tab.sqlite"
    page = tab(first, index.parent, SessionFile(file))
    state = page.call("finish", kind="folder", folder=index.name)[0]["state"]
    assert (state["name"], state["index"]["n_shapes"]) == ("c", 2)
    page.workspace.close()
    again = tab(first, index.parent, SessionFile(file)).call("meta")[0]
    assert again["index"]["path"] == str(index)
    assert "query" in again["capabilities"]


def test_an_opened_collection_shows_its_mean_also_after_a_restart(
    first,
    collection,  # noqa: F811
    tmp_path,
):
    file = tmp_path / "tab.sqlite"
    page = tab(first, collection.parent, SessionFile(file))
    state = page.call("finish", kind="folder", folder=collection.name)[0]["state"]
    assert state["collection"]["is_mean"]
    page.workspace.close()
    again = tab(first, collection.parent, SessionFile(file)).call("meta")[0]
    assert again["collection"] == state["collection"]


def test_a_shape_that_cannot_be_read_is_passed_over(first, tmp_path):
    broken = tmp_path / "shapes" / "a.ply"
    broken.parent.mkdir()
    broken.write_text("no ply")
    page = tab(first, tmp_path)
    error = page.error("finish", kind="folder", folder="shapes")
    assert error["message"].startswith("No shape of the folder can be opened. a cannot be opened")
    es.write_mesh(es.icosphere(1), broken.with_name("b.ply"))
    found = page.call("finish", kind="folder", folder="shapes")[0]
    assert found["state"]["name"] == "b"
    assert found["warnings"][0].startswith("a cannot be opened")


@pytest.mark.parametrize("place", ["..", "/etc", "away", "../../etc", "a\0b", "x" * 5000, "none"])
def test_nothing_outside_the_folder_is_seen(first, tmp_path, place):
    root = tmp_path / "root"
    root.mkdir()
    (root / "away").symlink_to("/etc")
    page = tab(first, root)
    for call in (
        ("array", {"name": f"folder/{place}"}),
        ("finish", {"kind": "folder", "folder": place}),
    ):
        assert page.error(*call)["message"].startswith(f"A folder must be in {root}")
    assert np.array_equal(page.call("meta")[0]["history"], [])


def test_without_a_folder_none_is_opened(first):
    page = Page(first.fork())
    assert "folders" not in page.call("meta")[0]["capabilities"]
    assert "command line" in page.error("array", name="folder/.")["message"]
