"""Eigenfunctions and heat as attributes of the vertices."""

import bpy
import numpy as np
from bpy.props import IntProperty

import eigenshape as es

from .operation import Operation, Steps


class EIGENSHAPE_OT_eigenfunctions(Operation, bpy.types.Operator):  # noqa: N801
    """Compute the lowest eigenfunctions of the surface, as the attributes "eigenfunction 0", 1 ..."""

    bl_idname = "eigenshape.eigenfunctions"
    bl_label = "Eigenfunctions"

    count: IntProperty(
        name="Number", description="Eigenfunctions, the constant 0 among them", default=10, min=1
    )

    def steps(self, context: bpy.types.Context) -> Steps:
        """Write one attribute for each eigenfunction, and show the last one."""
        surface, count = self.read(context, context.object), self.count
        spectrum = yield lambda progress: es.solve_spectrum(
            es.cotangent_laplacian(surface.mesh), count, progress=progress
        )
        surface.adopt()
        for number, function in enumerate(spectrum.eigenvectors.T):
            surface.write_attribute(f"eigenfunction {number}", function)
        surface.write_colors(es.plot.value_colors(spectrum.eigenvectors[:, -1], "RdBu_r"))
        self.report({"INFO"}, spectrum.certificate.explain())


class EIGENSHAPE_OT_heat(Operation, bpy.types.Operator):  # noqa: N801
    """Compute the heat that stays at each vertex, early to late, as the attributes "heat 0", 1 ..."""

    bl_idname = "eigenshape.heat"
    bl_label = "Heat"

    n_times: IntProperty(
        name="Times", description="Times in geometric sequence, in length²", default=5, min=2
    )
    n_modes: IntProperty(name="Eigenfunctions", default=100, min=2)

    def steps(self, context: bpy.types.Context) -> Steps:
        """Write one attribute for each time, and show the middle one."""
        surface, n_times, n_modes = self.read(context, context.object), self.n_times, self.n_modes

        def compute(progress: es.types.Progress) -> np.ndarray:
            laplacian = es.cotangent_laplacian(surface.mesh)
            k = min(n_modes, surface.mesh.n_vertices)
            spectrum = es.solve_spectrum(laplacian, k, progress=progress)
            times = es.spectral.default_times(spectrum, n_times)
            return es.heat_kernel_signature(spectrum, times)

        heat = yield compute
        surface.adopt()
        for number, function in enumerate(heat.T):
            surface.write_attribute(f"heat {number}", function)
        # Heat differs by orders of magnitude from place to place.
        surface.write_colors(es.plot.value_colors(np.log(heat[:, n_times // 2]), "inferno"))


register, unregister = bpy.utils.register_classes_factory(
    [EIGENSHAPE_OT_eigenfunctions, EIGENSHAPE_OT_heat]
)
