"""Every public object of the library, by its name."""

import inspect

import eigenshape as es


def rooms():
    """Return the public rooms by name, and rooms inside rooms: `retrieval.baselines`."""
    found = {}
    waiting = [(name, getattr(es, name)) for name in es.__all__]
    while waiting:
        name, thing = waiting.pop()
        if inspect.ismodule(thing):
            found[name] = thing
            waiting += [(f"{name}.{inner}", getattr(thing, inner)) for inner in thing.__all__]
    return dict(sorted(found.items()))


def public_things():
    """Return every public object that is no module, by its name; no name has two meanings."""
    things = {}
    for room in (es, *rooms().values()):
        for name in room.__all__:
            thing = getattr(room, name)
            if not inspect.ismodule(thing) and name != "__version__":
                assert things.setdefault(name, thing) is thing, name
    return dict(sorted(things.items()))
