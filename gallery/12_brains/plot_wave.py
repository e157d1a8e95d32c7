"""
A wave over the cortex
======================

Activity that starts at one place spreads as a damped wave. Each mode is an oscillator of its own, and
their sum is a film.
"""

from importlib.resources import files

import numpy as np

import eigenshape as es

folder = files("neuromodes") / "data"
surface = es.read_mesh(folder / "sp-human_tpl-fsLR_den-4k_hemi-L_midthickness.surf.gii")
spectrum = es.solve_spectrum(es.cotangent_laplacian(surface), 150)

# %%
# A source at the back for 5 ms, 80 times of 0.5 ms.

dt = 5e-4
distance = np.linalg.norm(
    surface.vertices - surface.vertices[surface.vertices[:, 1].argmin()], axis=1
)
source = np.outer(np.exp(-((distance / 12) ** 2)), np.arange(80) < 10)
drive = es.spectral.project(source, spectrum)
activity = es.spectral.reconstruct(es.modes.wave_response(drive, spectrum, dt), spectrum)

# %%
# Each picture relative to its largest value, since the wave is damped.

fields = {}
for step in (10, 30, 50, 79):
    now = activity[:, step] / np.abs(activity[:, step]).max()
    fields[f"{1000 * dt * step:g} ms"] = (surface, now)
es.plot.figure_fields(fields, "activity / largest", view=[-1, 0, 0], up="z", color_map="inferno")
