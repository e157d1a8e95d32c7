"""eigenshape operators: what there is to choose from."""

import eigenshape as es
from eigenshape.cli.console import out, print_json
from eigenshape.cli.inputs import JsonOption

NAMES = {
    "TriangleMesh": "triangles",
    "SimplicialMesh": "simplices",
    "PointCloud": "points",
    "sparray": "graphs",
}


def operators(*, as_json: JsonOption = False) -> None:
    """List the operators that `spectrum --operator` takes, with the shapes and options of each."""
    if as_json:
        print_json(
            {
                name: {**_facts(name), "is": entry.description}
                for name, entry in es.operators.OPERATORS.items()
            }
        )
        return
    for name, entry in es.operators.OPERATORS.items():
        facts = _facts(name)
        options = "".join(f" --{option.replace('_', '-')}" for option in facts["options"])
        takes = ", ".join(facts["takes"]) + (";" if options else "")
        out.print(f"[bold]{name:<15}[/]{entry.description}\n{'':<15}for {takes}{options}")


def _facts(name: str) -> dict[str, list[str]]:
    entry = es.operators.OPERATORS[name]
    return {
        "takes": [NAMES[kind.__name__] for kind in entry.shapes],
        "options": list(entry.options),
    }
