"""Two doors: a short one, and the rooms. Both are exact, and cost what is used."""

import ast
import inspect
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from public_names import public_things, rooms

import eigenshape as es

SOURCE = Path(es.__file__).parent
ROOMS = {
    "calculus", "collections", "compat", "compat.lapy", "deformation", "features", "geometry", "io", "matching",
    "modes", "morphometrics", "operators", "plot", "retrieval", "scans", "shapes", "spectral", "stability", "types",
}  # fmt: skip
PROMISED = {
    "read_mesh", "write_mesh", "TriangleMesh", "partial_scan", "make_creature", "cotangent_laplacian",
    "solve_spectrum", "heat_kernel_signature", "merge_tree", "segment", "find_parts", "describe", "ShapeIndex",
    "deform",
}  # fmt: skip
HEAVY = {"matplotlib", "meshio", "numpy", "rich", "scipy", "sqlite3"}


def test_the_short_door_holds_what_people_come_for():
    names = {name for name in es.__all__ if not inspect.ismodule(getattr(es, name))} - {
        "__version__"
    }
    assert names >= PROMISED
    assert len(names) <= 50


def test_the_rooms_are_these():
    assert rooms().keys() == ROOMS


def test_every_name_of_the_short_door_stands_in_a_room_too():
    in_rooms = {name for room in rooms().values() for name in room.__all__}
    left = {name for name in es.__all__ if not inspect.ismodule(getattr(es, name))} - in_rooms
    errors = {
        name
        for name in left
        if isinstance(getattr(es, name), type) and issubclass(getattr(es, name), Exception)
    }
    # The number of threads belongs to all rooms.
    assert left - errors == {"__version__", "set_threads"}


def test_names_are_unlike_each_other():
    spelt = Counter(name.lower() for name in public_things())
    assert not [name for name, count in spelt.items() if count > 1]


def test_a_name_of_a_room_is_the_object_and_never_a_module_of_that_name():
    code = "import eigenshape.features.merge_tree, eigenshape.geometry.enclosing_ball, eigenshape as es\n"
    code += "assert callable(es.features.merge_tree) and callable(es.geometry.enclosing_ball)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_name_that_is_not_there_is_named_with_a_name_that_is():
    done = subprocess.run(
        [sys.executable, "-c", "import eigenshape as es; es.solve_spectra"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert "no attribute 'solve_spectra'. Did you mean: 'solve_spectrum'?" in done.stderr


def test_a_name_of_a_room_that_is_sought_at_the_short_door_is_found():
    with pytest.raises(AttributeError, match=r"'find_heat_features'; use es\.retrieval\.find_heat"):
        es.find_heat_features  # noqa: B018


def test_importing_loads_nothing_that_is_not_used():
    code = f"import eigenshape, sys; print(sorted({HEAVY} & sys.modules.keys()))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_what_people_come_for_loads_no_statistics():
    """`scipy.stats` takes as long to load as a spectrum of 5,000 vertices takes to solve, twice."""
    wanted = [f"es.{name}" for name in sorted(PROMISED)]
    wanted += [
        "es.match_shapes",
        "es.collections.build_collection",
        "es.collections.carry_landmarks",
    ]
    code = f"import sys, eigenshape as es; {', '.join(wanted)}; print('scipy.stats' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_every_room_is_lazy_in_the_same_way():
    for path in SOURCE.rglob("__init__.pyi"):
        code = path.with_suffix(".py").read_text()
        assert "__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)" in code


def test_stubs_hand_names_on_and_hold_nothing_else():
    for path in SOURCE.rglob("__init__.pyi"):
        for line in path.read_text().splitlines():
            assert re.fullmatch(r"from \.[\w.]* import (\w+) as \1", line), f"{path}: {line}"


def test_every_error_stands_in_the_tree():
    drawn = ast.get_docstring(ast.parse((SOURCE / "_errors.py").read_text()))
    errors = {
        name
        for name in es.__all__
        if isinstance(kind := getattr(es, name), type) and issubclass(kind, es.EigenshapeError)
    }
    assert len(errors) == 7
    assert all(name in drawn for name in errors)
