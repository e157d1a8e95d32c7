"""The tables in plain text, beside what the thesis prints."""

from typing import Any

PROTOCOLS = ("mixed", "complete")
COLUMNS = ("incomplete", "complete", "all")
# Top-3 / Top-5, as printed in tables 5.2 and 5.4
THESIS = {
    "ours": ((88, 91), (78, 83), (84, 88)),
    "EVD": ((62, 62), (100, 100), (76, 76)),
    "LFD": ((56, 59), (39, 39), (50, 52)),
    "AGD": ((78, 81), (72, 94), (76, 86)),
    "GC": ((38, 41), (83, 89), (55, 58)),
}
NOT_OURS = "The thesis' 300 shapes cannot be had; its figures stand here as printed, for its set, and not for ours."
TITLES = {
    "mixed": "database of one version of each pose",
    "complete": "database of complete shapes only",
}


def printed(results: dict[str, Any], counts: dict[str, int]) -> str:
    """Return all tables: ours, strict and merged, differences, then the thesis'."""
    parts = [f"{counts['queries']} queries in {counts['draws']} draws of {counts['shapes']} shapes"]
    for name, rows in results.items():
        protocol = name.split(",")[0]
        parts.append(
            f"{TITLES[protocol]}{name[len(protocol) :]}\n\n{table(rows, signed='less' in name)}"
        )
    parts.append(f"as printed in the thesis\n\n{thesis_table()}\n\n{NOT_OURS}")
    return "\n\n".join(parts)


def table(rows: dict[str, Any], *, signed: bool = False) -> str:
    """Return one table in Markdown: Top-1 / Top-3 / Top-5, then mean average precision, by group of queries."""
    heads = [column for column in COLUMNS if all(column in row for row in rows.values())]
    lines = ["| method | " + " | ".join(heads) + " |", "|" + "---|" * (len(heads) + 1)]
    lines += [
        f"| {name} | " + " | ".join(cell(row[head], signed) for head in heads) + " |"
        for name, row in rows.items()
    ]
    return "\n".join(lines)


def cell(measures: dict[str, list[float]], signed: bool) -> str:
    """Return hit rates; of Top-3 with the interval that resampled queries give; and mean average precision."""
    sign = "+" if signed else ""
    one, three, five, precision = (
        f"{measures[name][0]:{sign}.1f}" for name in ("top1", "top3", "top5", "map")
    )
    low, high = (f"{end:{sign}.0f}" for end in measures["top3"][1:])
    return f"{one} / {three} [{low}, {high}] / {five}, {precision}"


def thesis_table() -> str:
    """Return tables 5.2 and 5.4 as one."""
    lines = [
        "| method, Top-3 / Top-5 | 32 incomplete | 18 complete | 50 together |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {name} | " + " | ".join(f"{three} / {five}" for three, five in row) + " |"
        for name, row in THESIS.items()
    ]
    return "\n".join(lines)
