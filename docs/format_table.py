"""Write the table of what is read, kept, named and refused of each format: from the docstrings of their readers.

python docs/format_table.py
"""

import re
from pathlib import Path

from eigenshape.io.formats.registry import FORMATS

PAGE = Path(__file__).parent / "files.md"
FATES = ("Read", "Kept", "Named", "Refused")
HEAD = "| suffix | " + " | ".join(fate.lower() for fate in FATES) + " |\n" + "|---" * 5 + "|\n"


def format_table() -> str:
    """Return the table, with a row for each reader."""
    suffixes: dict[str, list[str]] = {}
    for known in FORMATS:
        suffixes.setdefault(known.module, []).append(known.suffix)
    rows = []
    for module, names in suffixes.items():
        doc = next(known for known in FORMATS if known.module == module).load().__doc__ or ""
        facts = dict(re.findall(r"^(\w+): (.*(?:\n {4}.*)*)", doc, re.MULTILINE))
        cells = [" ".join(facts[fate].split()) for fate in FATES]
        rows.append(f"| {' '.join(names)} | {' | '.join(cells)} |\n")
    return HEAD + "".join(rows)


def page_with_table() -> str:
    """Return the page with the table in its place."""
    text = PAGE.read_text(encoding="utf-8")
    before, head, after = text.partition(HEAD.partition("\n")[0])
    rest = after.partition("\n\n")[2]
    return before + format_table() + "\n" + rest if head else text


if __name__ == "__main__":
    PAGE.write_text(page_with_table(), encoding="utf-8")
