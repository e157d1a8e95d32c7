"""eigenshape spectrum and operators: the lowest eigenvalues of a shape, with their proof, by any operator."""

from __future__ import annotations

import inspect
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_type_hints

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import (
    err,
    escape_text,
    out,
    print_json,
    print_table,
    print_written,
    progress_bar,
)
from eigenshape.io.formats.registry import CellKind
from eigenshape.operators.choices import Condition

USUAL = 20  # pairs
ORDERS = {"p2": 2, "p3": 3}
N_PICTURED = 8  # eigenfunctions in a picture: two rows of four
SHAPES = {
    "TriangleMesh": "triangles",
    "SimplicialMesh": "simplices",
    "PointCloud": "points",
    "sparray": "graphs",
}


def spectrum(
    shape: Path,
    *,
    k: int | None = None,
    below: float | None = None,
    above: float | None = None,
    operator: str | None = None,
    settings: list[str] | None = None,
    accuracy: float | None = None,
    boundary: Condition = "neumann",
    brackets: bool = False,
    dim: int = 2,
    cells: CellKind | None = None,
    repair: str = "none",
    output: Path | None = None,
    picture: Path | None = None,
    eigenfunctions: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    cache: Path | None = None,
    as_json: bool = False,
) -> None:
    """Compute the lowest eigenvalues of a shape and prove that none is missing.

    Parameters
    ----------
    k
        Number of eigenpairs, from the lowest one, or all if there are fewer. By default 20,
        unless --below is given.
    below
        Instead of -k: all eigenvalues below this value, in 1/length².
    above
        With --below: only eigenvalues from this value on, in 1/length².
    operator
        Operator, one of those that `eigenshape operators` lists. By default cotangent for meshes,
        point-cloud for points.
    settings : NAME=VALUE
        Option of the operator, such as mass=averaged or t=0.01; may be given several times.
        `eigenshape operators` lists the options of each operator, and `eigenshape operators mesh`
        explains those of one.
    accuracy
        Compute approximately, which needs less time and memory on millions of points, but proves
        nothing. Errors are at most this share of the largest eigenvalue, such as 1e-3. Up to
        100,000 points the certified method is as fast, and is taken instead.
    boundary
        Boundary condition: neumann leaves the boundary free, dirichlet fixes it at 0.
    brackets
        Also compute guaranteed lower and upper bounds of the eigenvalues of the mesh itself.
    output
        Write eigenvalues, eigenvectors and the proof (NPZ, which Spectrum.load reads).
    picture
        Draw the eigenvalues (PNG, SVG or PDF).
    eigenfunctions
        Draw the first eigenfunctions of a triangle mesh with their nodal lines (PNG, SVG or PDF).
    cache
        Folder that keeps spectra. A spectrum that is in it is read instead of computed.
    """
    side = steps.picture_side(view, up, picture, eigenfunctions, shapes=[shape])
    steps.require_output(output, (".npz",), "A spectrum")
    if accuracy is not None and below is not None:
        raise InvalidParameterError(
            "--accuracy needs -k, because the approximate method cannot count the eigenvalues below a value. Pass -k "
            "instead of --below, or leave out --accuracy."
        )
    found: Any = steps.load_shape(shape, repair, dim, cells)
    is_cloud = isinstance(found, es.PointCloud)
    if eigenfunctions and not isinstance(found, es.TriangleMesh):
        raise InvalidParameterError(
            f"--eigenfunctions draws triangle meshes; the shape is {found!r}. --picture draws the "
            "eigenvalues of any shape."
        )
    if brackets and is_cloud:
        raise InvalidParameterError("--brackets is for meshes; the shape is a point cloud.")
    name = operator or ("point-cloud" if is_cloud else "cotangent")
    options = _read_settings(name, settings or [])
    if accuracy is not None and name == "cotangent":
        options.setdefault("mass", "lumped")  # approximate eigenpairs need a diagonal
    fixed = _boundary_points(found, ORDERS.get(name, 1)) if boundary == "dirichlet" else None

    with progress_bar("spectrum") as progress:
        progress(0.0, "building the operator")
        laplacian = es.build_laplacian(found, operator, **options)
        if name == "point-cloud" and laplacian.kernel is None:
            name = "robust"  # as a warning says
        n_pairs = USUAL if k is None and below is None else k
        most = max(1, laplacian.n_points - (0 if fixed is None else len(fixed)))
        if n_pairs is not None and n_pairs > most:
            err.print(
                f"[yellow]note:[/] this shape has {most} eigenpairs, not {n_pairs}; all are computed"
            )
            n_pairs = most
        solved = es.solve_spectrum(
            laplacian,
            n_pairs,
            fixed=fixed,
            above=above,
            below=below,
            method="certified" if accuracy is None else "approximate",
            accuracy=accuracy,
            progress=progress,
            cache=cache,
        )
        first, count = solved.certificate.first, len(solved.eigenvalues)
        bounds = None
        if brackets:
            bounds = es.bracket_eigenvalues(
                found, first + count, boundary=boundary, progress=progress
            )

    if as_json:
        print_json(
            {
                "path": shape,
                "operator": name,
                "boundary": boundary,
                **options,
                "eigenvalues": solved.eigenvalues,
                "residuals": solved.residuals,
                "certificate": solved.certificate,
                **({"brackets": bounds} if bounds else {}),
            }
        )
    else:
        _print(solved, bounds)
    if picture:
        area = es.geometry.surface_area(found) if isinstance(found, es.TriangleMesh) else None
        figure = es.plot.figure_spectrum(solved, area=area, brackets=bounds)
        steps.save_picture(figure, picture)
    if eigenfunctions:
        start = min(1, count - 1) if first == 0 else 0  # the lowest is constant
        chosen = range(start, min(count, start + N_PICTURED))
        figure = es.plot.figure_eigenfunctions(found, solved, chosen, **side)
        steps.save_picture(figure, eigenfunctions)
    if output:
        solved.save(output)
        print_written(output)


def _boundary_points(shape: Any, order: int) -> Any:
    """Return the points of the boundary, of elements of an order; raise an error if there are none."""
    if isinstance(shape, es.PointCloud):
        raise InvalidParameterError(
            "--boundary dirichlet is for meshes; a point cloud has no boundary."
        )
    nodes = es.operators.fem_boundary_nodes(shape, order)
    if not nodes.size:
        raise InvalidParameterError(f"--boundary dirichlet needs a boundary; {shape!r} is closed.")
    return nodes


def _print(found: es.Spectrum, bounds: Any) -> None:
    """Print a table of the eigenvalues, and what is proved about them."""
    columns, first = ["i", "λ", "error at most"], found.certificate.first
    rows = [
        [str(first + index), f"{value:.10g}", f"{found.residuals[index]:.1e}"]
        for index, value in enumerate(found.eigenvalues)
    ]
    if bounds:
        columns += ["lower", "upper"]
        ends = zip(rows, bounds.lower[first:], bounds.upper[first:], strict=True)
        rows = [[*row, f"{low:.6g}", f"{high:.6g}"] for row, low, high in ends]
    print_table("Eigenvalues, in 1/length²", columns, rows)
    out.print(found.certificate.explain())
    if bounds:
        out.print(bounds.explain())


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


def _read_settings(operator: str, settings: list[str]) -> dict[str, Any]:
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
                "the options of each operator."
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
                    "--set gives an option one of its values; the values of "
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
