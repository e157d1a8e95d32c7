"""A number with a name has a unit and a reason."""

from readability import source_files, uncommented_constants


def test_every_numeric_constant_has_a_comment():
    missing = [line for path in source_files() for line in uncommented_constants(path)]
    assert not missing, "\n".join(missing)
