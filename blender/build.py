"""Build the extension for a platform: collect its wheels, complete its manifest, and zip all of it.

python blender/build.py --platform linux-x64 --output dist

It takes pip and a network. Zig compiles the kernels for every platform on any of them.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
MANIFEST = "blender_manifest.toml"
PYTHON = "3.11"  # of Blender 4.5 and 5.0
# Blender has its own, which other extensions use too: wheels must suit it, and it is left out.
NUMPY = "numpy==1.26.4"


# For each platform of Blender, its name for the compiler of the kernels, and the tags of its wheels.
PLATFORMS = {
    "linux-x64": (
        "linux-x86_64",
        ["manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux2014_x86_64"],
    ),
    "macos-arm64": ("macosx-arm64", ["macosx_12_0_arm64"]),
    "macos-x64": ("macosx-x86_64", ["macosx_12_0_x86_64"]),
    "windows-x64": ("win-amd64", ["win_amd64"]),
}


def collect_wheels(platform: str, folder: Path) -> None:
    """Build the wheels of certeig and eigenshape, and download what they need."""
    target, tags = PLATFORMS[platform]
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    kernels = os.environ | {"CERTEIG_TARGET": target}
    wheel = ["wheel", "--no-deps", "--wheel-dir", str(folder), str(ROOT / "certeig"), str(ROOT)]
    subprocess.run([*pip, *wheel], check=True, env=kernels)
    own = sorted(str(path) for path in folder.glob("*.whl"))
    choice = ["--only-binary=:all:", "--python-version", PYTHON, "--implementation", "cp"]
    choice += [f"--platform={tag}" for tag in tags]
    subprocess.run([*pip, "download", "--dest", str(folder), *choice, NUMPY, *own], check=True)
    for path in folder.glob("numpy-*.whl"):
        path.unlink()


def complete_manifest(platform: str, wheels: list[str]) -> str:
    """Return the manifest with a platform and the names of its wheels."""
    keys = {"platforms": [platform], "wheels": [f"./wheels/{name}" for name in sorted(wheels)]}
    lines = [f"{key} = {json.dumps(value, indent=2)}" for key, value in keys.items()]
    # Keys after the header of a table would be part of that table.
    before, header, after = (HERE / MANIFEST).read_text(encoding="utf-8").partition("[permissions]")
    return "\n".join([before.rstrip(), "", *lines, "", header + after])


def zip_extension(platform: str, wheels: Path, output: Path) -> Path:
    """Write the extension with the wheels of a folder as a zip file; return its path."""
    names = sorted(path.name for path in wheels.glob("*.whl"))
    manifest = complete_manifest(platform, names)
    version = tomllib.loads(manifest)["version"]
    output.mkdir(parents=True, exist_ok=True)
    path = output / f"eigenshape-{version}-{platform.replace('-', '_')}.zip"
    modules = [each for each in sorted(HERE.glob("*.py")) if each.name != Path(__file__).name]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(MANIFEST, manifest)
        for each in [*modules, HERE / "README.md", ROOT / "LICENSE"]:
            archive.write(each, each.name)
        for name in names:  # wheels are compressed already
            archive.write(wheels / name, f"wheels/{name}", zipfile.ZIP_STORED)
    return path


def main() -> None:
    """Build the extension for one platform."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--platform", choices=PLATFORMS, default="linux-x64")
    parser.add_argument("--output", type=Path, default=ROOT / "dist")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        wheels = Path(folder)
        collect_wheels(options.platform, wheels)
        path = zip_extension(options.platform, wheels, options.output)
    sys.stdout.write(f"{path} ({path.stat().st_size / 1e6:.0f} MB)\n")


if __name__ == "__main__":
    main()
