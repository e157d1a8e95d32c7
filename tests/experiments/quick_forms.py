"""What tests of experiments share: figures beside those expected, and tables of changes over seeds."""

import numpy as np

# Figures are printed with four digits. They come from continuous functions of shapes, which another
# CPU gets wrong by some 1e-12, so that at most the last digit turns over: by one in a thousand.
LAST_DIGIT = 1e-3


def require_expected(found, expected, *, one_more=0.0):
    """Compare each expected figure with the one that was found; there may be others.

    Whole numbers and words must be equal, other numbers to their last digit, or to `one_more`: by how
    much a mean moves where one of the things that it counts falls to the other side. A word like
    "≤ 1e-09" or "≥ 0.5" bounds a figure that the last digits of a CPU decide.
    """
    found = flat(found)
    missing = flat(expected).keys() - found.keys()
    assert not missing, sorted(missing)
    for name, wanted in flat(expected).items():
        value = found[name]
        if isinstance(wanted, str) and wanted.startswith("≤"):
            agrees = value <= float(wanted[1:])
        elif isinstance(wanted, str) and wanted.startswith("≥"):
            agrees = value >= float(wanted[1:])
        elif isinstance(wanted, float):
            agrees = abs(value - wanted) <= max(LAST_DIGIT * abs(wanted), one_more)
        else:
            agrees = value == wanted
        assert agrees, f"{name} is {value}; expected is {wanted}"


def flat(value, path=""):
    """Return each number of a nested table by its path."""
    if value and isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        return {name: x for key, item in items for name, x in flat(item, f"{path}/{key}").items()}
    return {path: value}


def largest(rows, part="mean"):
    """Return the largest change of each variant, the floor left out."""
    return np.array([row["largest"][part] for name, row in rows.items() if name != "M again"])
