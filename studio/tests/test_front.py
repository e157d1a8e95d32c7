"""The front end by itself: its types, its mathematics under Node, and which file imports which."""

import re
import runpy
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

BUILD = runpy.run_path(str(Path(__file__).parents[1] / "hatch_build.py"))
# A file of ours, imported for its values or for its types, at once or later
IMPORTED = re.compile(r"""\b(?:from|import)\s*\(?\s*["'](\.[^"'?]*)""")


@pytest.mark.parametrize(
    "command",
    [("typescript/bin/tsc", "--noEmit"), ("vitest/vitest.mjs", "run")],
    ids=["types", "mathematics"],
)
def test_front_end_checks_pass(command):
    if not (BUILD["FRONT"] / "node_modules").is_dir():
        BUILD["install_packages"]()
    BUILD["run_node"](*command)  # raises if the check fails


def test_front_end_imports_in_one_direction():
    imports = find_imports(BUILD["FRONT"] / "src")
    TopologicalSorter(imports).prepare()  # raises if files import each other in a circle
    # The window knows its contents; these know the interface in contract.ts instead.
    assert [name for name, names in imports.items() if "app.ts" in names] == ["main.ts"]


@pytest.mark.parametrize(
    "line",
    [
        'import { last } from "./last";',
        'import type { Last } from "./last";',
        'import {\n  first,\n  last,\n} from "../front/last";',
        'import "./last";',
        "export * from './last';",
        'const last = await import("./last");',
    ],
)
def test_circle_of_imports_is_found(tmp_path, line):
    front = tmp_path / "front"
    (front / "panels").mkdir(parents=True)
    (front / "first.ts").write_text(line)
    (front / "last.ts").write_text('import { panel } from "./panels/panel";')
    (front / "panels" / "panel.ts").write_text('import { first } from "../first";')
    with pytest.raises(CycleError, match=r"first\.ts"):
        TopologicalSorter(find_imports(front)).prepare()


def find_imports(folder: Path) -> dict[str, set[str]]:
    """Return, for each TypeScript file in a folder, the files in the folder that it imports."""
    imports = {}
    for path in sorted(folder.rglob("*.ts")):
        imported = set()
        for name in IMPORTED.findall(path.read_text()):
            script = path.parent / f"{name}.ts"
            # Markup, styles, shaders and tables are imported with their endings.
            file = script if script.exists() else path.parent / name
            assert file.is_file(), f"{path} imports {name}, which is no file."
            imported.add(file.resolve().relative_to(folder.resolve()).as_posix())
        imports[path.relative_to(folder).as_posix()] = imported
    return imports
