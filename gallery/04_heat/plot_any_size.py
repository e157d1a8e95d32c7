"""
Signatures for shapes of unknown size
=====================================

Times and eigenvalues are in units of the file. The scale-invariant signature is the same for a toy
and for the animal.
"""

import matplotlib.pyplot as plt

import eigenshape as es

toy = es.make_creature("giraffe", 1, n_vertices=1500)
animal = es.TriangleMesh(20.0 * toy.vertices, toy.faces)
head, hoof = int(toy.vertices[:, 1].argmax()), int(toy.vertices[:, 1].argmin())

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for mesh, style, name in ((toy, "-", "toy"), (animal, "--", "animal")):
    spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 100)
    times = es.spectral.default_times(spectrum, 60)
    heat = es.heat_kernel_signature(spectrum, times)
    free = es.spectral.scale_invariant_signature(spectrum)
    for vertex, color in ((head, "tab:red"), (hoof, "tab:blue")):
        left.loglog(times, heat[vertex], style, color=color)
        right.plot(free[vertex], style, color=color, marker="o")
    left.plot([], [], style, color="0.3", label=name)
left.set(xlabel="time, length²", ylabel="heat, 1/length²", title="heat kernel signature")
right.set(xlabel="frequency", title="scale-invariant: both curves coincide")
left.legend()

# %%
# The first of its numbers on the whole shape.

es.figure_field(animal, free[:, 0], "scale-invariant signature, frequency 0", color_map="magma")
# sphinx_gallery_thumbnail_number = 2
