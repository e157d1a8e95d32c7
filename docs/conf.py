"""How the docs site is built: python -m sphinx -W docs docs/_build."""

import inspect
import re
import sys
from importlib import import_module
from pathlib import Path

from sphinx.ext.autodoc.mock import mock

import eigenshape as es

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
from command_line import command_line_page  # noqa: E402  modules of this folder
from linking import link_returned_types, write_inventories  # noqa: E402
from turning import FOLDER, Turning, write_pages  # noqa: E402

project = "eigenshape"
author = "The eigenshape founders"
version = release = es.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "README.md", "paper"]
templates_path = ["_templates"]

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 4

intersphinx_mapping = write_inventories(HERE / "api" / "inventories")

autosummary_generate = True
autodoc_member_order = "bysource"
MOCKED = ["torch", "torch_geometric"]  # of the room for learning: the site is built without them
autodoc_mock_imports = MOCKED
autodoc_typehints = "none"  # docstrings give types and shapes
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
default_role = "code"  # `name` in docstrings is code, as in numpydoc

sphinx_gallery_conf = {
    "examples_dirs": "../gallery",
    "gallery_dirs": "gallery",
    "image_scrapers": ("matplotlib", "shown_figures.save_shown_figure"),
    "capture_repr": ("_repr_html_",),
    "ignore_repr_types": "matplotlib|eigenshape.plot",
    "doc_module": ("eigenshape",),
    "backreferences_dir": "gallery/backreferences",
    "show_signature": False,
    "remove_config_comments": True,
    "write_computation_times": False,
    "download_all_examples": False,
    # Colab has none of our packages; elsewhere this changes nothing.
    "first_notebook_cell": "%pip install -q 'eigenshape[neuro,decimate,sklearn]'",
    "abort_on_example_error": True,
}

html_theme = "pydata_sphinx_theme"
html_title = "eigenshape"
html_static_path = ["_static"]
html_favicon = "_static/favicon.svg"
html_css_files = ["eigenshape.css"]
html_context = {"default_mode": "auto"}  # light or dark, as the reader's system is
html_sidebars = {"decisions/*": []}  # a list of all would be longer than any of them
html_theme_options = {
    "show_prev_next": False,
    "navigation_with_keys": False,
    "header_links_before_dropdown": 5,
    "secondary_sidebar_items": ["page-toc"],
}


def write_api_pages() -> None:
    """Write a page for each public room, with all its names, from the `__all__` of the room."""
    folder = HERE / "api"
    pages = []
    rooms = [
        (name, getattr(es, name)) for name in es.__all__ if inspect.ismodule(getattr(es, name))
    ]
    rooms += [
        (f"{name}.{inner}", getattr(room, inner))
        for name, room in rooms
        for inner in room.__all__
        if inspect.ismodule(getattr(room, inner))
    ]
    with mock(MOCKED):
        torch_room = import_module("eigenshape.torch")
        for name in torch_room.__all__:
            getattr(torch_room, name)
    rooms.append(("torch", torch_room))
    for name, room in [("eigenshape", es), *rooms]:
        title = "The short door" if room is es else f"eigenshape.{name}"
        summary = (inspect.getdoc(room) or "").split("\n\n")
        things = {each: getattr(room, each) for each in room.__all__ if not each.startswith("__")}
        kinds = {
            "Functions": [
                each for each, thing in things.items() if inspect.isroutine(inspect.unwrap(thing))
            ],
            "Classes": [each for each, thing in things.items() if inspect.isclass(thing)],
        }
        kinds["Values"] = [
            each
            for each, thing in things.items()
            if not inspect.ismodule(thing) and each not in kinds["Functions"] + kinds["Classes"]
        ]
        lines = [
            title,
            "=" * len(title),
            "",
            *summary,
            "",
            f".. currentmodule:: {room.__name__}",
            "",
        ]
        for kind, names in kinds.items():
            if names and kind == "Values":
                lines += [kind, "-" * len(kind), ""]
                lines += [f"- ``{each}``{meaning(things[each])}" for each in names]
                lines += [""]
            elif names:
                lines += [kind, "-" * len(kind), "", ".. autosummary::"]
                lines += [] if room is es else ["   :toctree: generated"]
                lines += ["", *[f"   {each}" for each in names], ""]
        write_if_changed(folder / f"{name}.rst", "\n".join(lines))
        pages.append(name)
    write_if_changed(folder / "command-line.md", command_line_page())
    listed = "\n".join([*pages, "command-line"])
    write_if_changed(
        folder / "index.md",
        "# API\n\nNames of the short door are there as `es.name`; all others stand in their room, as "
        f"`es.geometry.decimate`.\n\n```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```\n",
    )


def meaning(thing: object) -> str:
    """Return what a value says of itself, if it has a docstring of its own, not that of its class."""
    doc = getattr(thing, "__doc__", None)
    if not isinstance(doc, str) or doc == type(thing).__doc__:
        return ""
    return f": {doc.splitlines()[0]}"


def write_if_changed(path: Path, text: str) -> None:
    """Write a page, unless it is there: an unchanged page is not built again."""
    path.parent.mkdir(exist_ok=True)
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def write_experiment_pages() -> None:
    """Write a page for each experiment, which includes its README."""
    include = "```{{include}} {}\n:relative-images:\n:relative-docs: ../\n```\n"
    readmes = sorted(HERE.parent.glob("experiments/*/README.md"))
    for readme in readmes:
        source = f"../../experiments/{readme.parent.name}/README.md"
        write_if_changed(HERE / "experiments" / f"{readme.parent.name}.md", include.format(source))
    listed = "\n".join(readme.parent.name for readme in readmes)
    index = include.format("../../experiments/README.md")
    index += f"\n```{{toctree}}\n:maxdepth: 1\n:hidden:\n\n{listed}\n```\n"
    write_if_changed(HERE / "experiments" / "index.md", index)


def link_experiment_pages(_app: object, _name: str, text: list[str]) -> None:
    """Lead links to READMEs of experiments and scripts of the gallery to their pages."""
    text[0] = re.sub(
        r"\]\(\.\./((?:\.\./)?)experiments/(\w+)/README\.md", r"](\1experiments/\2.md", text[0]
    )
    text[0] = text[0].replace("](../experiments/README.md", "](experiments/index.md")
    text[0] = re.sub(r"\]\(\.\./(gallery/\w+/\w+)\.py\)", r"](\1.rst)", text[0])


def escape_bars(
    _app: object, _what: str, _name: str, _thing: object, _options: object, lines: list[str]
) -> None:
    """Escape the bars of |x|, which would begin a substitution, outside of code."""
    for number, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            lines[number] = re.sub(
                r"`[^`]*`|\|", lambda found: "\\|" if found[0] == "|" else found[0], line
            )


def name_short_door(app: object, env: object) -> list[str]:
    """Let `es.name` lead to the page of the room that has the name."""
    objects = env.domains["py"].objects  # type: ignore[attr-defined]
    for name, entry in list(objects.items()):
        alias = f"eigenshape.{name.rpartition('.')[2]}"
        if name.startswith("eigenshape.") and hasattr(es, alias[11:]) and alias not in objects:
            objects[alias] = entry._replace(aliased=True)
    return []


def write_turning_pages(app: object, error: Exception | None) -> None:
    """Put the shapes that can be turned beside the pages that show them."""
    if error is None and app.builder.format == "html":  # type: ignore[attr-defined]
        write_pages(Path(app.outdir, FOLDER))  # type: ignore[attr-defined]


def setup(app: object) -> None:
    """Connect what is done to sources and docstrings."""
    app.add_directive("turning", Turning)  # type: ignore[attr-defined]
    app.connect("build-finished", write_turning_pages)  # type: ignore[attr-defined]
    app.connect("source-read", link_experiment_pages)  # type: ignore[attr-defined]
    app.connect("autodoc-process-docstring", escape_bars)  # type: ignore[attr-defined]
    app.connect("autodoc-process-docstring", link_returned_types)  # type: ignore[attr-defined]
    app.connect("env-updated", name_short_door)  # type: ignore[attr-defined]


write_api_pages()
write_experiment_pages()
