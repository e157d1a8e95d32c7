"""Finding the meshes of folders, with the facts of a table."""

import pytest

import eigenshape as es
from certeig.kit.errors import FileFormatError, InvalidParameterError
from eigenshape.io.folders import find_items
from eigenshape.retrieval.store.damage import StoreWarning

FILES = ["cats/felix.ply", "cats/old/tom.obj", "dogs/rex.OFF", "lonely.stl", "cats/notes.txt"]


@pytest.fixture
def folder(tmp_path):
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    return tmp_path


def test_shapes_are_named_by_their_path_and_classed_by_their_folder(folder):
    found = {item.name: (item.label, item.path.name) for item in find_items(folder)}
    assert found == {
        "cats/felix": ("cats", "felix.ply"),
        "cats/old/tom": ("old", "tom.obj"),
        "dogs/rex": ("dogs", "rex.OFF"),
        "lonely": (None, "lonely.stl"),
    }


def test_files_that_differ_only_in_their_suffix_keep_it(folder):
    (folder / "cats" / "felix.obj").touch()
    names = {item.name for item in find_items([folder / "cats"])}
    assert names == {"felix.ply", "felix.obj", "old/tom"}


def test_surfaces_of_freesurfer_without_a_suffix_are_found(tmp_path):
    es.write_mesh(es.icosphere(0), tmp_path / "lh.pial")
    es.io.write_fields(es.icosphere(0), tmp_path / "lh.sulc", {"a": range(12)})
    (tmp_path / "lh.cortex").write_text("no surface")
    es.write_mesh(es.icosphere(0), tmp_path / "rh.white")
    es.write_mesh(es.icosphere(0), tmp_path / "other.ply")
    assert [item.name for item in find_items(tmp_path)] == ["lh.pial", "other", "rh.white"]
    (item,) = find_items(tmp_path / "lh.pial")
    assert item.name == "lh.pial"
    assert es.io.read_surface(item.path).mesh.n_vertices == 12


def test_landmarks_beside_a_mesh_are_no_shape(tmp_path):
    for name in ("cat.ply", "cat.pts", "scan.pts"):
        (tmp_path / name).touch()
    assert [item.name for item in find_items(tmp_path)] == ["cat", "scan"]


def test_a_file_that_is_given_twice_counts_once(folder):
    cats = folder / "cats"
    assert len(find_items([cats, cats])) == len(find_items(cats))


def test_two_files_of_one_name_are_refused(folder):
    (folder / "dogs" / "felix.ply").touch()
    with pytest.raises(InvalidParameterError, match=r"'felix' is the name of both .*cats.*dogs"):
        find_items([folder / "cats", folder / "dogs"])


def test_no_mesh_is_an_error(tmp_path):
    with pytest.raises(InvalidParameterError, match="Folders of shapes must hold meshes"):
        find_items(tmp_path)


def test_parts_share_the_work_without_a_shape_in_two(folder):
    for number in range(40):
        (folder / f"shape{number}.ply").touch()
    parts = [{item.name for item in find_items(folder, part=(part, 5))} for part in range(1, 6)]
    assert all(parts)
    assert sum(map(len, parts)) == len(find_items(folder))
    assert set.union(*parts) == {item.name for item in find_items(folder)}


def test_a_part_does_not_depend_on_the_other_shapes(folder):
    before = {item.name for item in find_items(folder, part=(2, 3))}
    (folder / "another.ply").touch()
    assert before == {item.name for item in find_items(folder, part=(2, 3))} - {"another"}


@pytest.mark.parametrize(("part", "message"), [((0, 3), "it is 0"), ((4, 3), "it is 4")])
def test_a_part_that_is_not_there_is_refused(folder, part, message):
    with pytest.raises(InvalidParameterError, match=message):
        find_items(folder, part=part)


def test_a_table_gives_classes_tags_and_attributes(folder):
    table = folder / "table.csv"
    table.write_text(
        "name,label,tags,height,owner,limit\n"
        'cats/felix,tabby,indoor; fat,0.25,"Smith, J.",inf\n'
        "dogs/rex.OFF,,,,,\n"
    )
    found = {item.name: item for item in find_items(folder, labels=table)}
    felix, rex = found["cats/felix"], found["dogs/rex"]
    assert (felix.label, felix.tags) == ("tabby", ("indoor", "fat"))
    assert felix.attributes == {"height": 0.25, "owner": "Smith, J.", "limit": "inf"}
    assert (rex.label, rex.tags, rex.attributes) == ("dogs", (), {})
    assert found["cats/old/tom"].label == "old"  # which the table does not name


def test_a_table_of_a_whole_collection_serves_a_part_of_it(folder):
    table = folder / "table.csv"
    table.write_text("name,label\ncats/tom,x\ncats/felix,tabby\ncats/tim,x\n")
    with pytest.warns(StoreWarning, match=r"2 of 3 rows .* no file .*; line 2 names 'cats/tom'"):
        found = find_items(folder, labels=table)
    assert found[0].label == "tabby"


def test_links_to_folders_are_followed_once(folder, tmp_path_factory):
    outside = tmp_path_factory.mktemp("outside")
    (outside / "wolf.ply").touch()
    (outside / "back").symlink_to(folder)  # a circle
    for name in ("birds", "more"):
        (folder / name).symlink_to(outside)
    (folder / "a").symlink_to(folder / "cats")  # sorted before the folder itself
    names = [item.name for item in find_items(folder)]
    assert names == ["birds/wolf", "cats/felix", "cats/old/tom", "dogs/rex", "lonely"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("title,label\na,b\n", "must have a column 'name'; its columns are 'title', 'label'"),
        ("", "must hold a table; it is empty"),
        ("name,label\ncats/tom,x\n", "none of them, and line 2 names 'cats/tom'. .* 'cats/felix'"),
        ("name,label\n,x\n", "line 2 does not"),
        ("name,label\ncats/felix,a,b\n", "must have 2 cells a line; line 2 has more"),
        (b"name,label\n\xff,x\n", "in UTF-8"),
    ],
)
def test_a_table_that_is_wrong_is_refused(folder, text, message):
    table = folder / "table.csv"
    table.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(FileFormatError, match=message):
        find_items(folder, labels=table)
