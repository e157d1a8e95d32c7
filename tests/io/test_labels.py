import numpy as np
import pytest

from eigenshape._errors import FileFormatError
from eigenshape.io.labels import read_labels, write_labels


def read(tmp_path, text, name="a.seg"):
    path = tmp_path / name
    path.write_text(text)
    return read_labels(path)


@pytest.mark.parametrize("text", ["3\n-1\n7\n", " 3 \r\n-1\r\n\r\n7", "# parts\n3 # head\n-1\n+7\n"])
def test_a_whole_number_a_line(tmp_path, text):
    found = read(tmp_path, text)
    assert found.dtype == np.int64
    assert found.tolist() == [3, -1, 7]


def test_labels_come_back_as_they_were_written(tmp_path):
    labels = np.array([0, 5, -2, 2**62 + 1])
    write_labels(labels, tmp_path / "labels.txt")
    assert np.array_equal(read_labels(tmp_path / "labels.txt"), labels)


def test_labels_out_of_json(tmp_path):
    assert read(tmp_path, '{"parts": [], "face_labels": [2, 0, 2]}', "a.JSON").tolist() == [2, 0, 2]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.seg", "1\nhead\n", r"a\.seg: A label must be a whole number; line 2 has 'head' in 'head'"),
        ("a.seg", "1\n\n2.5\n", r"a\.seg: A label must be a whole number; line 3 has '2\.5'"),
        ("a.seg", "1 2\n3 4\n", r"a\.seg: A line must hold the label of one face; line 1 is '1 2'"),
        ("a.seg", "1\n2 3\n", r"a\.seg: A line must hold the label of one face; line 2 is '2 3'"),
        ("a.seg", f"{2**63}\n", r"a\.seg: A label must fit into 64 bits; line 1 has '9223372036854775808'"),
        ("a.seg", "", r"a\.seg must hold labels; it is empty"),
        ("a.json", "{", r"a\.json: A \.json file of labels must hold JSON; it does not: Expecting property name"),
        ("a.json", "[" * 10**6, r"a\.json: A \.json file of labels must hold JSON"),
        ("a.json", "[1, 2]", r'a\.json: A \.json file of labels must have a list "face_labels"'),
        ("a.json", '{"face_labels": 3}', r'a\.json: A \.json file of labels must have a list "face_labels"'),
        (
            "a.json",
            '{"face_labels": [1, "x"]}',
            r"a\.json: Labels must be whole numbers of 64 bits; that of face 1 is 'x'",
        ),
        ("a.json", '{"face_labels": [true]}', r"that of face 0 is True"),
        ("a.json", '{"face_labels": [1.0]}', r"that of face 0 is 1\.0"),
        ("a.json", f'{{"face_labels": [{2**63}]}}', r"that of face 0 is 9223372036854775808"),
    ],
)
def test_what_is_no_label_is_named(tmp_path, name, text, message):
    with pytest.raises(FileFormatError, match=message):
        read(tmp_path, text, name)
