"""The default mass of tetrahedra is the one with the least errors."""

import json
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_tetrahedra"
EXPECTED = json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))


def test_averaged_mass_errs_least_on_most_shapes():
    for form, count in (("full", 5), ("quick", 3)):
        medians = [row["median"] for row in EXPECTED[form].values()]
        best = [min(("lumped", "consistent", "averaged"), key=row.get) for row in medians]
        assert best.count("averaged") >= count, (form, best)
