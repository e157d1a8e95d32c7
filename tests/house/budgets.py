"""What each group of the house may hold: tokens, modules and public names, beside the CPU time of its quick tests.

    python tests/house/budgets.py           print what each group holds
    python tests/house/budgets.py --write   lower what is below its budget, and drop private names no longer used
    python tests/house/budgets.py --grow    write what is there, more or less: the commit says what it is for

Budgets stand in budgets.toml; private_across_walls.txt lists what groups import from others though no room names it.
`python check.py --record` writes the CPU seconds, which no test compares; 0 is what has not been timed.
"""

import argparse
import sys
import tomllib
from collections import Counter

from groups import GROUPS, HOUSE, group_of, modules, private_across_walls, public_names
from readability import code_tokens

BUDGETS = HOUSE / "budgets.toml"
WALLS = HOUSE / "private_across_walls.txt"
SLACK = 0.01  # of a budget may be unused; a landing that frees more lowers it
SECONDS = "quick_tests_cpu_seconds"
HEAD = """\
# What each group may hold; tokens are those of Python without docstrings, comments and imports.
# `python tests/house/budgets.py --write` lowers numbers, `python check.py --record` writes the CPU seconds.
"""

Row = dict[str, float]


def measure() -> dict[str, Row]:
    """Return what each group holds."""
    rows: dict[str, Row] = {
        group: {"tokens": 0, "modules": 0, "public_names": 0} for group in GROUPS
    }
    for path in modules().values():
        row = rows[group_of(path)]
        row["modules"] += 1
        row["tokens"] += count_tokens(path.read_text(encoding="utf-8"))
    for _, origin in {each for names in public_names().values() for each in names.items()}:
        rows[group_of(modules()[origin])]["public_names"] += 1
    return rows


def count_tokens(text: str) -> int:
    """Return the number of tokens of code, without docstrings, comments and imports."""
    return len(code_tokens(text, with_imports=False))


def read_budgets() -> dict[str, Row]:
    """Return the rows of the file, the sum among them."""
    return tomllib.loads(BUDGETS.read_text(encoding="utf-8"))


def write_budgets(rows: dict[str, Row]) -> None:
    """Write a row for each group, and the sum."""
    rounded = {
        group: {kind: round(number, 1) for kind, number in rows[group].items()} for group in GROUPS
    }
    total: Counter[str] = Counter()
    for row in rounded.values():
        total.update(row)
    text = HEAD
    for name, row in (rounded | {"sum": total}).items():
        numbers = "".join(f"{kind} = {round(number, 1)}\n" for kind, number in row.items())
        text += f"\n[{name}]\n{numbers}"
    BUDGETS.write_text(text, encoding="utf-8")


def find_misfits(held: dict[str, Row], budgets: dict[str, Row]) -> list[str]:
    """Return a sentence for each number that is above its budget, or far below."""
    found = []
    for group, counts in held.items():
        for kind, count in counts.items():
            budget = budgets[group][kind]
            fact = f"{group} holds {count} {kind.replace('_', ' ')}; its budget is {budget}."
            if count > budget:
                remedy = (
                    f"Free {count - budget}, or run `python tests/house/budgets.py --grow` and say in "
                    "the commit what they are for."
                )
                found.append(f"{fact} {remedy}")
            elif count < (1 - SLACK) * budget:
                found.append(f"{fact} Lower it: `python tests/house/budgets.py --write`.")
    return found


def main() -> None:
    """Print what groups hold, or write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="lower budgets to what is there")
    parser.add_argument("--grow", action="store_true", help="write what is there, more or less")
    options = parser.parse_args()
    held, budgets = measure(), read_budgets()
    private = private_across_walls()
    if options.write:
        private = [line for line in private if line in WALLS.read_text().splitlines()]
        for group, row in held.items():
            held[group] = {kind: min(count, budgets[group][kind]) for kind, count in row.items()}
    if options.write or options.grow:
        write_budgets({group: budgets.get(group, {}) | row for group, row in held.items()})
        WALLS.write_text("".join(f"{line}\n" for line in private), encoding="utf-8")
        return
    for group, row in held.items():
        numbers = "".join(f"{count:8} {kind.replace('_', ' ')}" for kind, count in row.items())
        sys.stdout.write(f"{group:9}{numbers}\n")


if __name__ == "__main__":
    main()
