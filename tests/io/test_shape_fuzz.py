"""Files of unstructured meshes and points with bytes changed, cut out or doubled: a shape or a named error, ever."""

import meshio
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lapy import TetMesh
from test_shape_files import CUBE, POLYDATA, TABLES, pcd

from certeig.kit.errors import CerteigError
from eigenshape.io.shape_files import read_shape


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fuzz")
    contents = {f"polydata {kind}.vtk": data for kind, data in POLYDATA.items()} | TABLES
    contents |= {f"{kind}.pcd": pcd(kind) for kind in ("ascii", "binary", "binary_compressed")}
    TetMesh(CUBE.points, CUBE.simplices).write_vtk(str(folder / "lapy.vtk"))
    contents["lapy.vtk"] = (folder / "lapy.vtk").read_bytes()
    for name, kind, options in (
        ("a.mesh", "medit", {}),
        ("a.meshb", "medit", {}),
        ("a.msh", "gmsh", {}),
        ("b.msh", "gmsh", {"binary": False}),
        ("c.msh", "gmsh22", {}),
        ("d.msh", "gmsh22", {"binary": False}),
        ("a.vtk", "vtk", {}),
        ("b.vtk", "vtk", {"binary": False}),
        ("a.vtu", "vtu", {}),
    ):
        meshio.write_points_cells(
            folder / name, CUBE.points, [("tetra", CUBE.simplices)], file_format=kind, **options
        )
        contents[name] = (folder / name).read_bytes()
    return folder, contents


@pytest.mark.filterwarnings("ignore::UserWarning")  # what is not kept is named
@settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.data())
def test_a_changed_file_is_a_shape_or_a_named_error(files, capfd, data):
    folder, contents = files
    name = data.draw(st.sampled_from(sorted(contents)))
    changed = bytearray(contents[name])
    for _ in range(data.draw(st.integers(1, 6))):
        place = data.draw(st.integers(0, len(changed) - 1))
        kind = data.draw(st.sampled_from(["byte", "cut", "double"]))
        length = data.draw(st.integers(1, 30))
        if kind == "byte":
            changed[place] = data.draw(st.integers(0, 255))
        elif kind == "cut" and len(changed) > length + 1:
            del changed[place : place + length]
        elif kind == "double":
            changed[place:place] = changed[place : place + length]
    path = folder / f"changed{name[name.rindex('.') :]}"
    path.write_bytes(changed)
    try:
        shape = read_shape(path)
    except CerteigError as error:
        assert "changed" in str(error)  # noqa: PT017 - either way the outcome is checked
    else:
        assert np.isfinite(shape.points).all()
    assert capfd.readouterr() == ("", "")
