import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.plot.camera import aim_camera, in_picture
from eigenshape.plot.fields import (
    figure_eigenfunctions,
    figure_field,
    figure_segments,
    part_colors,
    value_colors,
)
from eigenshape.plot.figure import save_figure
from eigenshape.plot.render import AMBIENT, INK, draw, palette
from eigenshape.plot.sheet import Panel, figure_contact_sheet
from eigenshape.plot.spectra import figure_spectrum
from eigenshape.scans.partial import partial_scan
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.spectral.bounds.brackets import bracket_eigenvalues
from eigenshape.spectral.solve import solve_spectrum

SPHERE = icosphere(3)
RED, BLUE = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def colors_at(drawing, mask):
    """Mean color of the opaque pixels under a mask."""
    opaque = drawing.image[..., 3] > 0.99
    return drawing.image[opaque & mask][:, :3].mean(axis=0)


def test_a_sphere_covers_a_disc():
    drawing = draw(SPHERE, aim_camera(SPHERE, size=200))
    radius = 200 * 0.92 / 2
    assert drawing.image[..., 3].sum() == pytest.approx(np.pi * radius**2, rel=0.01)
    assert drawing.image[0, 0, 3] == 0
    assert drawing.image[100, 100, 3] == 1


def test_up_is_up_and_the_front_is_towards_us():
    camera = aim_camera(SPHERE, size=100)
    places = in_picture(SPHERE, camera)
    _, y, z = SPHERE.vertices.T
    assert np.corrcoef(places[:, 1], -y)[0, 1] > 0.9
    assert np.corrcoef(places[:, 2], z)[0, 1] > 0.7
    standing = in_picture(SPHERE, aim_camera(SPHERE, up="z", size=100))
    assert np.corrcoef(standing[:, 1], -z)[0, 1] > 0.9


def test_a_scan_is_looked_at_from_where_it_was_seen():
    view = np.array([-0.5, 0.2, -0.8])
    scan = partial_scan(torus(), view).mesh
    towards = aim_camera(scan).rotation[2]
    assert towards @ (view / np.linalg.norm(view)) > 0.9


def test_halves_have_their_colors_on_their_sides():
    camera = aim_camera(SPHERE, size=160)
    high = SPHERE.vertices[SPHERE.faces].mean(axis=1)[:, 1] > 0
    drawing = draw(SPHERE, camera, face_colors=np.where(high[:, None], RED, BLUE))
    rows = np.arange(160)[:, None] * np.ones((1, 160))
    top, bottom = colors_at(drawing, rows < 50), colors_at(drawing, rows > 125)
    assert top[0] > 0.4
    assert top[2] < 0.01
    assert bottom[2] > 0.2
    assert bottom[0] < 0.01


def test_the_nodal_line_lies_where_the_function_is_zero():
    camera = aim_camera(SPHERE, size=300)
    height = (
        SPHERE.vertices @ camera.rotation[1]
    )  # rises down the picture: zero along the middle row
    drawing = draw(
        SPHERE, camera, vertex_colors=np.ones((SPHERE.n_vertices, 3)), zero_set_of=height
    )
    dark = np.argwhere((drawing.image[..., 0] < (INK + AMBIENT) / 2) & (drawing.image[..., 3] == 1))
    assert len(dark) > 200
    assert np.abs(dark[:, 0] - 150).max() < 6


def test_hidden_vertices_are_known():
    camera = aim_camera(SPHERE, size=200)
    drawing = draw(SPHERE, camera)
    depth = SPHERE.vertices @ camera.rotation[2]
    assert drawing.visible[depth > 0.25].all()
    assert not drawing.visible[depth < -0.25].any()


def test_boundaries_are_dark():
    sheet = grid(4, 4)
    drawing = draw(sheet, aim_camera(sheet, size=120))
    column, row = drawing.places[:5].mean(axis=0).astype(int)  # the middle of one side
    near_side = drawing.image[row - 3 : row + 4, column - 3 : column + 4]
    assert near_side[near_side[..., 3] == 1][:, 0].min() == pytest.approx(INK)
    assert drawing.image[60, 60, 0] > 2 * INK


def test_the_same_picture_twice_and_at_any_scale():
    first = draw(SPHERE, aim_camera(SPHERE, size=80)).image
    again = draw(SPHERE, aim_camera(SPHERE, size=80)).image
    larger = TriangleMesh(SPHERE.vertices * 2.0**300, SPHERE.faces)
    assert np.array_equal(first, again)
    assert np.array_equal(first, draw(larger, aim_camera(larger, size=80)).image)


def test_palette_tells_fifteen_labels_apart_and_grays_the_rest():
    colors = palette(np.arange(15))
    apart = np.linalg.norm(colors[:, None] - colors[None], axis=2)[np.triu_indices(15, 1)]
    assert apart.min() > 0.14
    assert ((colors >= 0) & (colors <= 1)).all()
    assert np.ptp(palette(np.array([-1]))) == 0


@pytest.mark.long
def test_figures_are_labeled(tmp_path):
    mesh = icosphere(2)
    found = solve_spectrum(cotangent_laplacian(mesh), 12)
    functions = figure_eigenfunctions(mesh, found, range(1, 4))
    assert [axes.get_title() for axes in functions.axes][:3] == [
        f"φ$_{{{i}}}$,  λ = {found.eigenvalues[i]:.4g}" for i in (1, 2, 3)
    ]
    assert "eigenfunction" in functions.axes[-1].get_ylabel()
    field = figure_field(mesh, mesh.vertices[:, 0], "x, in meters")
    assert field.axes[-1].get_ylabel() == "x, in meters"
    curve = figure_spectrum(found, area=12.5, brackets=bracket_eigenvalues(mesh, 12))
    (axes,) = curve.axes
    assert "λ" in axes.get_ylabel()
    assert len(axes.get_legend().get_texts()) == 4
    labels = np.arange(mesh.n_faces) % 3
    parts = figure_segments(mesh, labels, np.array([0, 5, 9]))
    assert "3 parts" in parts.axes[0].get_title()
    panel = Panel(mesh, "title", labels, np.array([0]))
    sheet = figure_contact_sheet(panel, [panel] * 4, caption="caption")
    for number, figure in enumerate((functions, field, curve, parts, sheet)):
        save_figure(figure, tmp_path / f"{number}.png")
        assert (tmp_path / f"{number}.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
        assert (tmp_path / f"{number}.png").stat().st_size > 4000


@pytest.mark.long
def test_a_part_of_a_spectrum_is_numbered_from_its_first():
    mesh = icosphere(2)
    found = solve_spectrum(cotangent_laplacian(mesh), above=5.0, below=15.0)
    (axes,) = figure_spectrum(found, brackets=bracket_eigenvalues(mesh, 16)).axes
    numbers = axes.lines[0].get_xdata()
    assert (numbers[0], numbers[-1]) == (4, 15)
    assert figure_eigenfunctions(mesh, found, range(2)).axes[0].get_title().startswith("φ$_{4}$")


def test_files_are_whole_repeatable_and_of_a_known_kind(tmp_path):
    figure = figure_spectrum(solve_spectrum(cotangent_laplacian(icosphere(1)), 5))
    for suffix in (".png", ".svg", ".pdf"):
        save_figure(figure, tmp_path / f"one{suffix}")
        assert (tmp_path / f"one{suffix}").stat().st_size > 1000
    save_figure(figure, tmp_path / "two.png")
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()
    assert len(list(tmp_path.iterdir())) == 4
    with pytest.raises(
        InvalidParameterError, match=r"A picture must end in .png, .svg, .pdf; .* ends in '.bmp'"
    ):
        save_figure(figure, tmp_path / "one.bmp")
    with pytest.raises(
        InvalidParameterError, match="A picture must be written to a folder that exists"
    ):
        save_figure(figure, tmp_path / "nowhere" / "one.png")


def test_figures_take_lists_and_refuse_what_does_not_fit_the_mesh():
    mesh = icosphere(1)  # 42 vertices, 80 faces
    found = solve_spectrum(cotangent_laplacian(mesh), 4)
    assert figure_eigenfunctions(mesh, found, 2).axes[0].get_title().startswith("φ$_{2}$")
    with pytest.raises(InvalidParameterError, match=r"An index must lie in 0\.\.3; it is 4"):
        figure_eigenfunctions(mesh, found, [1, 4])
    with pytest.raises(InvalidParameterError, match="at least one eigenfunction"):
        figure_eigenfunctions(mesh, found, [])
    with pytest.raises(InvalidParameterError, match=r"which has 162 vertices; .* have 42 entries"):
        figure_eigenfunctions(icosphere(2), found, [1])

    assert figure_field(mesh, list(range(42))).axes[-1].get_ylim() == (0, 41)
    with pytest.raises(InvalidParameterError, match=r"one number per vertex.*shape is \(42, 3\)"):
        figure_field(mesh, mesh.vertices)

    halves = [0] * 40 + [1] * 40
    assert figure_segments(mesh, halves).axes[0].get_title() == "2 parts"
    assert part_colors(mesh, halves).shape == (42, 3)
    for draw_parts in (figure_segments, part_colors):
        with pytest.raises(InvalidParameterError, match=r"per face, shape \(80,\); .* \(42,\)"):
            draw_parts(mesh, [0] * 42)
    with pytest.raises(InvalidParameterError, match=r"A feature point must lie in 0\.\.41"):
        figure_segments(mesh, halves, [42])

    with pytest.raises(InvalidParameterError, match="values must be finite; entry 1 is nan"):
        value_colors([0.0, np.nan])


@pytest.mark.long
def test_vertices_without_a_value_are_gray_and_the_bar_says_so():
    mesh = icosphere(2)
    values = mesh.vertices[:, 0].copy()
    values[values > 0.5] = np.nan
    figure = figure_field(mesh, values, "x")
    assert figure.axes[-1].get_ylabel() == "x (gray: no value)"
    picture = figure.axes[0].images[0].get_array()
    drawn = picture[picture[..., 3] > 0.99][:, :3]
    gray = np.ptp(drawn, axis=1) < 0.02
    assert 0.02 < gray.mean() < 0.5
    known = np.where(np.isnan(values), 0.0, values)
    drawn = figure_field(mesh, known, "x").axes[0].images[0].get_array()
    drawn = drawn[drawn[..., 3] > 0.99][:, :3]
    assert (np.ptp(drawn, axis=1) < 0.02).mean() < 0.02


def test_limits_are_those_of_the_color_bar():
    mesh = icosphere(1)
    bar = figure_field(mesh, mesh.vertices[:, 0], limits=(-0.5, 2)).axes[-1]
    assert bar.get_ylim() == (-0.5, 2)
    assert figure_field(mesh, np.full(42, 3.0), limits=(0, 1)).axes[-1].get_ylim() == (0, 1)
    with pytest.raises(InvalidParameterError, match=r"limits must be two numbers, the lower one"):
        figure_field(mesh, mesh.vertices[:, 0], limits=(2, 1))
    with pytest.raises(InvalidParameterError, match="values must hold a number; all are NaN"):
        figure_field(mesh, np.full(42, np.nan))
    with pytest.raises(InvalidParameterError, match="values must be finite"):
        figure_field(mesh, np.full(42, np.inf))


def test_labels_of_vertices_are_named_with_what_draws_them():
    mesh = es.icosphere(1)
    labels = (mesh.vertices[:, 1] > 0).astype(int)
    for draw_parts in (es.figure_segments, es.plot.part_colors, es.retrieval.LabeledShape):
        with pytest.raises(
            es.InvalidParameterError, match=r"the shape is \(42,\).*es.figure_field"
        ):
            draw_parts(mesh, labels)
    es.figure_field(mesh, labels)  # what the message advises, both ways
    assert es.figure_segments(mesh, labels[mesh.simplices[:, 0]]).axes[0].get_title() == "2 parts"
    # Of the right place and the wrong type, the message says nothing of places.
    with pytest.raises(es.InvalidParameterError, match=r"the type float64\.$"):
        es.figure_segments(mesh, np.zeros(mesh.n_faces))


def test_values_of_faces_are_named_with_what_draws_them():
    mesh = es.icosphere(1)
    left = es.TriangleMesh(mesh.vertices - [2, 0, 0], mesh.faces)
    heights = mesh.vertices[mesh.faces].mean(axis=1)[:, 1]
    advice = (
        r"shape \(42,\); there is one for each of 80 faces\. .* es\.calculus\.average_onto_points"
    )
    for draw_field in (
        lambda: es.figure_field(mesh, heights),
        lambda: es.plot.figure_fields({"ball": (mesh, heights)}),
        lambda: es.plot.figure_cortex({"left": left}, {"left": heights}),
    ):
        with pytest.raises(es.InvalidParameterError, match=advice):
            draw_field()
    es.figure_field(mesh, es.calculus.average_onto_points(mesh, heights))


@pytest.mark.parametrize(
    ("name", "n_due", "n_given"),
    [("vertex_colors", 42, 80), ("face_colors", 80, 42), ("zero_set_of", 42, 80)],
)
def test_colors_of_the_wrong_place_are_not_drawn(name, n_due, n_given):
    mesh = es.icosphere(1)
    camera = es.plot.aim_camera(mesh, size=32)
    values = np.zeros(n_given) if name == "zero_set_of" else np.zeros((n_given, 3))
    fact = (
        f"{name} must have {n_due} rows; there are {n_given}. Colors of vertices are vertex_colors"
    )
    with pytest.raises(es.InvalidParameterError, match=fact):
        es.plot.draw(mesh, camera, **{name: values})
