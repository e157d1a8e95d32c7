"""Groups hold no more than their budgets allow, and use no more of each other than is listed."""

import budgets
import pytest
from budgets import SECONDS, WALLS, count_tokens, find_misfits, measure, read_budgets
from groups import GROUPS, ROOT, arrows_against_walls, group_of, modules, private_across_walls


def test_groups_fit_their_budgets():
    misfits = find_misfits(measure(), read_budgets())
    assert not misfits, "\n".join(misfits)


def test_what_does_not_fit_is_named_with_a_remedy_that_works(tmp_path, monkeypatch):
    monkeypatch.setattr(budgets, "BUDGETS", tmp_path / "budgets.toml")
    rows = {group: {"tokens": 1000, "modules": 3} for group in GROUPS}
    budgets.write_budgets(rows)
    held = rows | {"core": {"tokens": 1012, "modules": 3}, "lab": {"tokens": 989, "modules": 2}}
    more, fewer, one_fewer = find_misfits(held, read_budgets())
    assert more.startswith("core holds 1012 tokens; its budget is 1000. Free 12, or run")
    assert fewer.startswith("lab holds 989 tokens; its budget is 1000. Lower it:")
    assert one_fewer.startswith("lab holds 2 modules; its budget is 3. Lower it:")
    assert not find_misfits(rows | {"lab": {"tokens": 990, "modules": 3}}, read_budgets())
    budgets.write_budgets(held)
    assert not find_misfits(held, read_budgets())
    assert read_budgets()["sum"] == {"tokens": 11_001, "modules": 32}


def test_tokens_are_those_of_code():
    text = '"""Text."""\nimport os\n\n\ndef f(x):\n    """Text."""\n    # why\n    return x + os.sep  # end\n'
    assert count_tokens(text) == 12  # def f ( x ) : return x + os . sep


def test_the_sum_is_that_of_the_groups_and_all_have_every_number():
    rows = read_budgets()
    total = rows.pop("sum")
    assert rows.keys() == GROUPS.keys()
    for kind, number in total.items():
        assert number == pytest.approx(sum(row[kind] for row in rows.values()), abs=1e-6)
    assert all(row.keys() == total.keys() for row in rows.values())
    assert SECONDS in total


def test_every_module_has_a_group_and_every_place_of_a_group_is_there():
    assert not [path for path in modules().values() if group_of(path) is None]
    for group in GROUPS.values():
        assert not [
            place for place in group["sources"] + group["tests"] if not (ROOT / place).exists()
        ]


def test_private_names_across_walls_only_become_fewer():
    found, listed = private_across_walls(), WALLS.read_text(encoding="utf-8").splitlines()
    more = sorted(set(found) - set(listed))
    assert not more, f"no room names these for another group; take a public name: {more}"
    assert found == listed, "fewer are left: python tests/house/budgets.py --write"


def test_no_group_uses_one_above_it():
    assert not arrows_against_walls()
