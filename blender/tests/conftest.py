"""Register the extension, and make objects in an empty scene."""

import importlib.util
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender as a module: pip install bpy==4.5.*")
import eigenshape as es  # noqa: E402 - after the skip

# Load the folder as Blender does, under a name of its own: `eigenshape` is the library.
FOLDER = Path(__file__).parent.parent
_spec = importlib.util.spec_from_file_location("eigenshape_extension", FOLDER / "__init__.py")
extension = importlib.util.module_from_spec(_spec)
sys.modules["eigenshape_extension"] = extension
_spec.loader.exec_module(extension)


@pytest.fixture(scope="session", autouse=True)
def _registered() -> Iterator[None]:
    extension.register()
    yield
    extension.unregister()


@pytest.fixture(autouse=True)
def _empty_scene() -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)


Add = Callable[..., bpy.types.Object]


@pytest.fixture
def add() -> Add:
    """Return a function that adds a mesh to the scene, selected and active."""

    def add_object(name: str, vertices: np.ndarray, faces: list[list[int]]) -> bpy.types.Object:
        data = bpy.data.meshes.new(name)
        data.from_pydata(vertices, [], faces)
        made = bpy.data.objects.new(name, data)
        bpy.context.collection.objects.link(made)
        made.select_set(True)
        bpy.context.view_layer.objects.active = made
        return made

    return add_object


@pytest.fixture(scope="session")
def creature() -> es.TriangleMesh:
    """Return a quadruped with 1,000 vertices."""
    return es.make_creature("quadruped", n_vertices=1000)
