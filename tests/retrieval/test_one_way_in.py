"""A mesh enters by one door: the verbs of retrieval convert it once, and trust it from there on."""

import sys
from collections import Counter

import pytest

import eigenshape as es
from eigenshape.geometry import conversion

DOORS = ("as_mesh", "as_simplicial", "as_shape")
ROOMS = ("eigenshape.retrieval", "eigenshape.scans", "eigenshape.matching")
FISH = es.make_creature("fish", n_vertices=500)
ARRAYS = (FISH.vertices, FISH.faces)
HEAT = es.retrieval.SCALE_FREE


def room_of(frame):
    return frame.f_globals.get("__name__", "")


def conversions(call):
    """Count who converts a mesh in the rooms of the verbs."""
    found = Counter()

    def count(frame, event, _):
        if event != "call" or frame.f_code.co_name not in DOORS:
            return
        if room_of(frame) == conversion.__name__:
            caller = frame.f_back
            while not room_of(caller).startswith("eigenshape"):  # checks of types stand between
                caller = caller.f_back
            if room_of(caller).startswith(ROOMS):
                found[f"{room_of(caller)}.{caller.f_code.co_name}"] += 1

    sys.setprofile(count)
    try:
        call()
    finally:
        sys.setprofile(None)
    return dict(found)


@pytest.fixture(scope="module")
def index():
    index = es.ShapeIndex.create(None)
    index.add("fish", FISH, n_views=0)
    index.add("fish by heat", FISH, n_views=0, recipe=HEAT)
    return index


@pytest.mark.parametrize("mesh", [FISH, ARRAYS], ids=["mesh", "arrays"])
@pytest.mark.parametrize("recipe", [None, HEAT], ids=["patches", "heat"])
def test_a_mesh_is_converted_once_to_be_described(mesh, recipe):
    assert conversions(lambda: es.describe(mesh, recipe)) == {
        "eigenshape.retrieval.kinds.describe": 1
    }


@pytest.mark.parametrize("mesh", [FISH, ARRAYS], ids=["mesh", "arrays"])
def test_a_mesh_is_converted_once_to_be_searched_for(index, mesh):
    once = {"eigenshape.retrieval.kinds.describe_query": 1}
    assert conversions(lambda: index.query(mesh)) == once
    assert conversions(lambda: es.retrieval.query_indexes(mesh, [index])) == once
    descriptor = es.describe(mesh)
    assert conversions(lambda: index.query(descriptor)) == {}


@pytest.mark.parametrize("recipe", [None, HEAT], ids=["patches", "heat"])
def test_a_mesh_is_converted_once_to_be_added(index, recipe):
    found = conversions(lambda: index.add("more", ARRAYS, recipe=recipe, n_views=2, replace=True))
    assert found.pop("eigenshape.retrieval.thumbnails.draw_thumbnail") == 1  # of its picture
    assert found == {"eigenshape.retrieval.index.add": 1}
