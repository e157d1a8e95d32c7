"""What is released says one version everywhere, and its files hold what they should."""

import json
import re
import runpy
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[2]
PROJECTS = {
    project["name"]: project
    for project in (
        tomllib.loads(path.read_text())["project"]
        for path in (ROOT / place / "pyproject.toml" for place in ("certeig", ".", "studio"))
    )
}
VERSION = PROJECTS["eigenshape"]["version"]
# What conda-forge calls otherwise than PyPI
OF_CONDA = {"matplotlib-base": "matplotlib", "prometheus_client": "prometheus-client"}
BUILD = runpy.run_path(str(ROOT / "wheels" / "build.py"))
ELF = b"\x7fELF".ljust(18) + b"\x3e\x00"  # the header of a library for Linux on x86-64


@pytest.mark.parametrize(
    ("file", "place"),
    [
        ("certeig/pyproject.toml", r'^version = "(.*)"'),
        ("certeig/src/certeig/__init__.py", r'^__version__ = "(.*)"'),
        ("pyproject.toml", r'^    "certeig>=(.*),<2"'),
        ("studio/pyproject.toml", r'^version = "(.*)"'),
        ("studio/pyproject.toml", r'^    "eigenshape>=(.*),<2"'),
        ("pyproject.toml", r'^studio = \["eigenshape-studio>=(.*),<2"'),
        ("CITATION.cff", "^version: (.*)"),
        ("CHANGELOG.md", r"^## (.*) \("),
        ("codemeta.json", r'^  "version": "(.*)"'),
        ("conda-recipe/recipe.yaml", r'^  version: "(.*)"'),
        ("blender/blender_manifest.toml", r'^version = "(.*)"'),
    ],
)
def test_every_place_says_the_version(file: str, place: str):
    said = re.search(place, (ROOT / file).read_text(), re.MULTILINE)
    assert said is not None
    assert said[1] == VERSION


def test_archives_and_citations_name_one_day_and_one_place():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    archive = json.loads((ROOT / "codemeta.json").read_text())
    assert archive["datePublished"] == str(citation["date-released"])
    assert archive["codeRepository"] == citation["repository-code"]
    assert archive["description"] == PROJECTS["eigenshape"]["description"]
    assert archive["keywords"] == citation["keywords"]


def test_the_recipe_for_conda_requires_what_the_packages_do():
    recipe = yaml.safe_load((ROOT / "conda-recipe" / "recipe.yaml").read_text())
    assert recipe["schema_version"] == 1
    assert set(recipe) == {"schema_version", "context", "recipe", "source", "build", "outputs"}
    assert {output["package"]["name"] for output in recipe["outputs"]} == set(PROJECTS)
    for output in recipe["outputs"]:
        project = PROJECTS[output["package"]["name"]]
        python, *others = output["requirements"]["run"]
        assert python == f"python {project['requires-python']}"
        lowest = {}
        for line in others:
            # Those of this repository are pinned to the version that is built.
            ours = re.fullmatch(r'\$\{\{ pin_subpackage\("(.*?)", .*\) \}\}', line)
            name, _, versions = (f"{ours[1]} >={VERSION}" if ours else line).partition(" ")
            lowest[OF_CONDA.get(name, name)] = versions
        wanted = (Requirement(text) for text in project["dependencies"])
        assert lowest == {each.name: str(each.specifier).removeprefix("<2,") for each in wanted}
        (licensed,) = {output["about"]["license"], project["license"]}
        assert licensed == "MIT"
        assert (ROOT / output["about"]["license_file"]).is_file()


@pytest.mark.parametrize(
    ("files", "fault"),
    [
        ({}, None),
        ({"certeig/_libraries/kernels-4.so": b"\x7fELF".ljust(18) + b"\xb7\x00"}, "linux-aarch64"),
        ({"certeig/_libraries/kernels-4.so": b"no library"}, "'kernels-4.so': None"),
        ({"certeig/_libraries/kernels-5.so": ELF}, "kernels-5.so"),
        ({"tests/test_it.py": b""}, "tests/test_it.py does not belong"),
        ({"certeig/__pycache__/it.pyc": b""}, "does not belong"),
        ({"certeig/it.py": f"'{sys.prefix}'".encode()}, "it.py holds a path"),
    ],
)
def test_faults_of_a_wheel_are_found(tmp_path, files, fault):
    tag = BUILD["TARGETS"]["linux-x86_64"].wheel
    path = tmp_path / f"certeig-{VERSION}-py3-none-{tag}.whl"
    whole = {f"certeig/_libraries/kernels-{level}.so": ELF for level in (2, 3, 4)}
    with zipfile.ZipFile(path, "w") as wheel:
        for name, content in ({f"certeig-{VERSION}.dist-info/WHEEL": b""} | whole | files).items():
            wheel.writestr(name, content)
    found = BUILD["find_faults"](path)
    assert len(found) == (fault is not None)
    assert fault is None or fault in found[0]


def test_a_wheel_of_kernels_names_its_platform(tmp_path):
    path = tmp_path / f"certeig-{VERSION}-py3-none-any.whl"
    zipfile.ZipFile(path, "w").close()
    assert BUILD["find_faults"](path) == ["any is not the tag of a platform"]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("macosx-x86_64", b"\xcf\xfa\xed\xfe\x07\x00\x00\x01"),
        ("macosx-arm64", b"\xcf\xfa\xed\xfe\x0c\x00\x00\x01"),
        ("win-amd64", b"MZ".ljust(60) + b"\x40\x00\x00\x00PE\x00\x00\x64\x86"),
        ("win-arm64", b"MZ".ljust(60) + b"\x40\x00\x00\x00PE\x00\x00\x64\xaa"),
    ],
)
def test_the_platform_of_a_library_is_read_from_its_header(name, content):
    assert BUILD["find_platform"](content) == name


def test_a_release_does_not_mix_with_older_files(tmp_path, monkeypatch):
    (tmp_path / "old.whl").touch()
    monkeypatch.setattr("sys.argv", ["build.py", str(tmp_path)])
    with pytest.raises(SystemExit, match=r"go to an empty folder; .* is not empty"):
        BUILD["main"]()
