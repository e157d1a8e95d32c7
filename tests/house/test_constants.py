"""A number with a name has a unit and a reason."""

from readability import SOURCE, uncommented_constants


def test_every_numeric_constant_has_a_comment():
    missing = [
        line for path in sorted(SOURCE.rglob("*.py")) for line in uncommented_constants(path)
    ]
    assert not missing, "\n".join(missing)
