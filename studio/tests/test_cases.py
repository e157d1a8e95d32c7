"""What the front end stores of the library is what the library says today."""

import json

import numpy as np
from make_cases import CASES, TABLES, cases, color_tables


def test_color_tables_equal_those_of_plot() -> None:
    """The window and the pictures have the same colors."""
    assert json.loads(TABLES.read_text(encoding="utf-8")) == color_tables()


def test_stored_cases_equal_what_the_library_computes() -> None:
    """The results that the tests of the front end compare with are not out of date."""
    stored, fresh = json.loads(CASES.read_text(encoding="utf-8")), cases()
    for name in ("eigenvalues", "times", "signatures", "areas"):
        np.testing.assert_allclose(stored["heat"][name], fresh["heat"][name], rtol=1e-8, atol=1e-12)
    for old, new in zip(stored["deformation"]["drags"], fresh["deformation"]["drags"], strict=True):
        np.testing.assert_allclose(old["axis"], new["axis"], rtol=1e-8, atol=1e-12)
        np.testing.assert_allclose(old["angle"], new["angle"], rtol=1e-8)
