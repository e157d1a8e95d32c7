"""`eigenshape studio` without arguments, with one file, two, a folder, an index: what each opens."""

import numpy as np
import pytest
from test_workspace import Page

import eigenshape as es
from eigenshape_studio.opening import open_workspace
from eigenshape_studio.others import folders


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shapes")
    for level, name in enumerate(("a.ply", "b.off", "c.obj")):
        es.write_mesh(es.icosphere(level), folder / name)
    (folder / "notes.txt").write_text("not a shape")
    return folder


@pytest.fixture(scope="module")
def index(tmp_path_factory, folder):
    index = es.ShapeIndex.create(tmp_path_factory.mktemp("index"))
    index.add("c", es.icosphere(2), source=str(folder / "c.obj"), n_views=0)
    index.add("without file", es.make_creature("fish", n_vertices=500), n_views=0)
    return index.folder


def opened(*paths, **options):
    """Return the state of a page that is opened with these paths."""
    workspace = open_workspace(paths, **options)
    state = Page(workspace).call("meta")[0]
    workspace.close()
    return state


def test_without_a_path_a_creature_is_opened():
    state = opened()
    assert (state["name"], state["shapes"], state["index"]) == (
        "quadruped",
        [[0, "quadruped"]],
        None,
    )


def test_files_stand_in_the_list_and_the_first_is_shown(folder):
    assert opened(folder / "b.off")["n_vertices"] == 42
    state = opened(folder / "c.obj", folder / "a.ply")
    assert (state["name"], state["n_vertices"]) == ("c.obj", 162)
    assert state["shapes"] == [[0, "c.obj"], [1, "a.ply"]]


def test_a_folder_stands_for_its_files(folder, tmp_path, monkeypatch):
    state = opened(folder)
    assert state["n_vertices"] == 12
    assert [name for _, name in state["shapes"]] == ["a", "b", "c"]
    with pytest.raises(
        es.InvalidParameterError, match="Folders of shapes must hold meshes or points"
    ):
        open_workspace([tmp_path])
    monkeypatch.setattr(folders, "MOST_LISTED", 2)
    assert len(opened(folder)["shapes"]) == 2


def test_an_index_is_opened_with_the_files_of_its_shapes(folder, index):
    state = opened(index)
    assert (state["name"], state["n_vertices"]) == ("c", 162)
    assert state["index"]["n_shapes"] == 2
    assert opened(folder / "a.ply", index=index)["index"]["path"] == str(index)


def test_another_shape_of_the_list_is_read_when_it_is_chosen(folder):
    first = open_workspace([folder])
    page = Page(first.fork())
    assert page.call("finish", kind="choose", shape=2)[0]["state"]["n_vertices"] == 162
    np.testing.assert_array_equal(page.array("faces"), es.read_mesh(folder / "c.obj").faces)
    assert not first.history.shapes[2].loaded  # another tab reads it anew
    first.close()
