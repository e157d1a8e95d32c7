"""The page of the command line, made of what the verbs say of themselves."""

from eigenshape.cli.verbs import INDEX_VERBS, VERBS, load_verb


def command_line_page() -> str:
    """Return a table of all verbs, and below it the arguments and options of each."""
    names = [name for name in VERBS if name != "index"]
    names += [f"index {name}" for name in INDEX_VERBS]
    table = ["# The command line", "", "| verb | does |", "|---|---|"]
    sections = []
    for name in names:
        verb = load_verb(name)
        first = verb.help.split("\n\n")[0]
        table.append(f"| [`{name}`](#eigenshape-{name.replace(' ', '-')}) | {_cell(first)} |")
        sections += [f"## eigenshape {name}", "", verb.help, "", "| takes | |", "|---|---|"]
        for parameter in verb.params:
            spelled = ", ".join(
                f"`{text}`" for text in [*parameter.opts, *parameter.secondary_opts]
            )
            sections.append(f"| {spelled} | {_cell(parameter.help)} |")
        sections.append("")
    return "\n".join([*table, "", *sections])


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
