"""Shapes that the reader can turn: pages of the studio without a server, which open inside a page.

    python docs/turning.py FOLDER

The directive `turning` of the site names one of them and the panel that it opens:

    :::{turning} hand
    :panel: spectrum
    :::
"""

import sys
from collections.abc import Callable
from html import escape
from importlib.resources import files
from pathlib import Path

import numpy as np
from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.util.docutils import SphinxDirective

import eigenshape as es
from eigenshape_studio.report import write_report

FOLDER = "turning"  # of the site
MOST_BYTES = 1_000_000  # of a page, three quarters of which are the viewer


def hand() -> dict[str, object]:
    """Return the hand of the front page."""
    return {"mesh": es.make_creature("hand", n_vertices=3000)}


def biped() -> dict[str, object]:
    """Return the figure whose parts the front page shows."""
    return {"mesh": es.make_creature("biped", n_vertices=3000)}


def scan() -> dict[str, object]:
    """Return what is seen of a lizard from one side."""
    lizard = es.make_creature("lizard", 1, n_vertices=3000)
    view = [0.3, 0.7, 0.6]
    return {"mesh": es.partial_scan(lizard, view).mesh, "view": view, "up": "y"}


def giraffe() -> dict[str, object]:
    """Return a giraffe whose neck was bent, with how far each vertex moved."""
    shape = es.make_creature("giraffe", n_vertices=3000)
    low, high = shape.vertices[:, 1].min(), shape.vertices[:, 1].max()
    neck = es.deformation.BoxRegion([-np.inf, low + 0.62 * (high - low), -np.inf], [np.inf] * 3)
    boundary = es.deformation.region_boundary(shape, es.deformation.region_mask(shape, neck))
    turn = es.Rotation(shape.vertices[boundary].mean(axis=0), axis=[1, 0, 0], angle=np.deg2rad(60))
    bent = es.deform(es.rig_shape(shape), neck, turn)
    moved = np.linalg.norm(bent.vertices - shape.vertices, axis=1)
    return {"mesh": bent, "values": {"how far it moved": moved / moved.max()}}


def cortex() -> dict[str, object]:
    """Return the left half of a cortex with a mode of its surface, without the medial wall."""
    start = files("neuromodes") / "data" / "sp-human_tpl-fsLR_den-4k_hemi-L_"
    surface = es.read_mesh(f"{start}midthickness.surf.gii")
    mask = es.io.read_fields(f"{start}medmask.label.gii")["values"]
    part = es.geometry.mask_surface(surface, mask)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(part.mesh), 10)
    mode = spectrum.eigenvectors[:, 4]
    top = np.argmax(part.mesh.vertices[:, 2])
    return {"mesh": part.mesh, "values": {"mode 4": mode * np.sign(mode[top])}}


SHAPES: dict[str, Callable[[], dict[str, object]]] = {
    "hand": hand,
    "biped": biped,
    "scan": scan,
    "giraffe": giraffe,
    "cortex": cortex,
}


def write_pages(folder: Path) -> list[Path]:
    """Write the pages that are not there yet, in ten seconds."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, make_shape in SHAPES.items():
        path = folder / f"{name}.html"
        if not path.exists():
            write_report(**make_shape(), path=path, name=name, n_modes=12)
            if path.stat().st_size > MOST_BYTES:
                raise ValueError(f"{path} has {path.stat().st_size} bytes, over {MOST_BYTES}.")
        paths.append(path)
    return paths


class Turning(SphinxDirective):
    """A fold that holds one of the pages, which the browser loads when the fold is opened."""

    required_arguments = 1
    option_spec = {"panel": directives.unchanged}  # noqa: RUF012  as docutils has it

    def run(self) -> list[nodes.Node]:
        """Return the fold as HTML."""
        (name,) = self.arguments
        if name not in SHAPES:
            raise self.error(f"turning takes one of {', '.join(SHAPES)}; it was given {name}.")
        up = "../" * self.env.docname.count("/")
        panel = self.options.get("panel", "shape")
        source = escape(f"{up}{FOLDER}/{name}.html#{panel}", quote=True)
        # Browsers load a lazy frame also in a fold that is closed, so opening it gives the address.
        frame = f'<iframe data-page="{source}" title="{name}, to be turned"></iframe>'
        load = "const frame = this.querySelector('iframe'); frame.src ||= frame.dataset.page"
        fold = f'<details class="turning" ontoggle="{load}"><summary>Turn it</summary>{frame}</details>'
        return [nodes.raw("", fold, format="html")]


if __name__ == "__main__":
    for written in write_pages(Path(sys.argv[1])):
        print(written)
