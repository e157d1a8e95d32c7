"""eigenshape operators: what there is to choose from, and the options of each operator."""

from __future__ import annotations

import inspect
from types import NoneType
from typing import Any, get_args, get_type_hints

import eigenshape as es
from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import escape_text, out, print_json

SHAPES = {
    "TriangleMesh": "triangles",
    "SimplicialMesh": "simplices",
    "PointCloud": "points",
    "sparray": "graphs",
}


def operators(
    name: str | None = None,
    *,
    as_json: bool = False,
) -> None:
    """List the operators that `spectrum --operator` takes, with the shapes and options of each.

    For instance: eigenshape operators mesh

    Parameters
    ----------
    name
        Operator to explain. By default all are listed.
    """
    chosen = es.operators.OPERATORS
    if name is not None:
        if name not in chosen:
            raise InvalidParameterError(f"NAME must be one of {', '.join(chosen)}; it is {name!r}.")
        chosen = {name: chosen[name]}
    facts: dict[str, dict[str, Any]] = {
        each: {
            "takes": [SHAPES[kind.__name__] for kind in entry.shapes],
            "options": {option: _values(kinds) for option, kinds in _option_kinds(each).items()},
            "is": entry.description,
        }
        for each, entry in chosen.items()
    }
    if as_json:
        print_json(facts)
        return
    for each, fact in facts.items():
        out.print(f"[bold]{each:<15}[/]{fact['is']}\n{'':<15}for {', '.join(fact['takes'])}")
        for option, values in fact["options"].items():
            out.print(f"{'':<15}--set {option}={'|'.join(values)}")
    if name is not None and chosen[name].options:
        docstring = inspect.getdoc(chosen[name].build) or ""
        parameters = docstring.partition("Parameters\n----------\n")[2].split("\n\n")[0]
        # The first line of an option follows the shape.
        _, first_option, others = parameters.partition(f"\n{chosen[name].options[0]}")
        for line in f"{first_option}{others}".splitlines():
            out.print(escape_text(line))


def read_settings(operator: str, settings: list[str]) -> dict[str, Any]:
    """Return the options of an operator, by name, that texts such as "t=0.01" give."""
    if operator not in es.operators.OPERATORS:
        return {}  # `build_laplacian` names those that there are
    options: dict[str, Any] = {}
    known = _option_kinds(operator)
    for setting in settings:
        name, equals, text = (part.strip() for part in setting.partition("="))
        if not equals or name not in known:
            raise InvalidParameterError(
                f"--set takes NAME=VALUE; the {operator} operator has the options "
                f"{', '.join(known) or 'none'}, and it is {setting!r}. `eigenshape operators` lists "
                "those of each operator."
            )
        kinds = known[name]
        if text in kinds:
            options[name] = text
        elif text == "none" and NoneType in kinds:
            options[name] = None
        else:
            try:
                options[name] = float(text) if float in kinds else int(text)
            except ValueError as error:
                raise InvalidParameterError(
                    "--set gives an option one of its values; those of "
                    f"{name} are {', '.join(_values(kinds))}, and it is {text!r}."
                ) from error
    return options


def _option_kinds(operator: str) -> dict[str, list[Any]]:
    """Return what each option of an operator may be: texts, None, and the types of numbers.

    The signature of the function that builds the operator says so.
    """
    entry = es.operators.OPERATORS[operator]
    hints = get_type_hints(getattr(entry.build, "func", entry.build))  # of a partial, its function
    found = {}
    for name in entry.options:
        kinds = get_args(hints[name]) or (hints[name],)  # of a union, or the only one
        found[name] = [each for kind in kinds for each in get_args(kind) or (kind,)]
    return found


def _values(kinds: list[Any]) -> list[str]:
    """Return how the values of an option are written: NUMBER, none, or the texts that it takes."""
    names = {NoneType: "none"}
    return [kind if isinstance(kind, str) else names.get(kind, "NUMBER") for kind in kinds]
