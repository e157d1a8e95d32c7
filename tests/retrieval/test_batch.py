import pytest
from describers import RECIPE, by_content, descriptor

from eigenshape.retrieval.batch import Item, Workers, build_index, content_digest
from eigenshape.retrieval.index import ShapeIndex


@pytest.fixture
def index(tmp_path):
    return ShapeIndex.create(tmp_path / "index")


def items(folder, **contents):
    for name, word in contents.items():
        (folder / name).write_text(word)
    return [Item(name, folder / name, "label") for name in contents]


def build(index, todo, timeout=60.0, told=None):
    return build_index(index, todo, by_content, recipes=(RECIPE,), workers=Workers(2, timeout), told=told)


def test_bad_shapes_are_named_and_the_others_go_on(index, tmp_path):
    todo = items(tmp_path, a="1", b="raise", c="die", d="2", e="hang", f="surprise", g="3", h="4")
    heard = []
    report = build(index, todo, timeout=4.0, told=lambda *news: heard.append(news))
    assert report.added == ("a", "d", "g", "h")
    assert dict(report.failed) == {
        "b": "A face must have area; face 3 has none.",
        "c": "it ended its process with exit code 77",
        "e": "it took more than 4 s",
        "f": "KeyError: 'lost'",
    }
    assert [record.name for record in index.records()] == ["a", "d", "g", "h"]
    assert [news[0] for news in heard] == list(range(1, 9))
    assert {news[2]: news[3] for news in heard}["b"] == "A face must have area; face 3 has none."


def test_what_is_there_is_not_done_twice(index, tmp_path):
    todo = items(tmp_path, a="1", b="2")
    build(index, todo[:1])
    report = build(index, todo)
    assert (report.added, report.skipped, report.failed) == (("b",), ("a",), ())
    assert index.records()[0].digest == content_digest(tmp_path / "a")


def test_a_changed_file_replaces_what_it_was(index, tmp_path):
    todo = items(tmp_path, a="1", b="2")
    build(index, todo)
    (tmp_path / "a").write_text("5")
    assert build(index, todo).added == ("a",)
    assert index.query(descriptor(5))[0].name == "a"
    assert len(index) == 2


def test_ctrl_c_keeps_what_is_done(index, tmp_path):
    todo = items(tmp_path, **{f"s{number}": str(number) for number in range(8)})

    def interrupt(n_done, n_items, name, error):
        if n_done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build(index, todo, told=interrupt)
    assert len(index) == 3
    report = build(index, todo)
    assert len(report.added) == 5
    assert len(report.skipped) == 3


def test_a_missing_file_is_named(index, tmp_path):
    report = build(index, [Item("gone", tmp_path / "gone")])
    assert report.failed[0][0] == "gone"
    assert "No such file" in report.failed[0][1]
