"""Compare, search, segment and bend 3D shapes by the spectra of their Laplace operators.

Shapes are meshes, point clouds and tetrahedra. The functions that most people need stand here; all
functions stand in the rooms:

geometry     meshes and point clouds: measures, topology, geodesics, repairs
shapes       synthetic shapes, with exact spectra
scans        partial scans and a depth camera
operators    discrete Laplace operators
spectral     certified spectra, signatures, functional maps, filters, compression
calculus     gradients, equations, flows, heat distances, conformal maps
modes        maps by eigenmodes: fits, nulls, waves, morphometry, parcels
features     merge trees, feature points, parts
deformation  regions, motions, editing sessions, transfer of poses
stability    how far two shapes and their spectra differ
retrieval    descriptors, an index of shapes, search
matching     dense correspondences of parts and wholes
collections  specimens of one kind: their maps, mean shape and landmarks
morphometrics landmarks and their files, statistics of shapes
io           files, trimesh and PyVista
plot         pictures
compat       stand-ins for classes of other libraries, such as LaPy's solver
types        annotations for your own signatures

Examples
--------
>>> import eigenshape as es
>>> mesh = es.icosphere(3)
>>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), k=4)
>>> spectrum.eigenvalues.round(1).tolist()
[0.0, 2.0, 2.0, 2.0]
"""

from types import ModuleType

import lazy_loader

from eigenshape import _makers  # noqa: F401  what messages suggest

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_load = __getattr__


def __getattr__(name):
    """Load a public name. If it is in a room only, the error says in which."""
    try:
        return _load(name)
    except AttributeError as err:
        if name in __all__ or name.startswith("_"):
            raise
        rooms = [room for room in __all__ if isinstance(_load(room), ModuleType)]
        homes = [f"es.{room}.{name}" for room in rooms if name in _load(room).__all__]
        remedy = f"; use {homes[0]}" if homes else ""
        raise AttributeError(f"eigenshape has no attribute {name!r}{remedy}") from err
