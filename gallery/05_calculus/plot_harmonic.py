"""
A smooth function with given values
===================================

0 at the feet, 1 on the head, and as smooth as can be between: a harmonic function. The lengths of its
level sets are girths.
"""

import matplotlib.pyplot as plt
import numpy as np

import eigenshape as es

giraffe = es.make_creature("giraffe", n_vertices=2500)
laplacian = es.cotangent_laplacian(giraffe)
height = giraffe.vertices[:, 1]
feet = np.flatnonzero(height < np.quantile(height, 0.01))
head = np.flatnonzero(height > np.quantile(height, 0.95))
fixed = np.concatenate([feet, head])
values = np.concatenate([np.zeros(len(feet)), np.ones(len(head))])
up = es.calculus.solve_harmonic(laplacian, fixed, values)
es.figure_field(giraffe, np.round(15 * up) / 15, "harmonic function, in bands", color_map="turbo")

# %%
# The girth at each level: four legs, then the trunk, then the neck.

levels = np.linspace(0.02, 0.98, 60)
girths = [es.calculus.level_set(giraffe, up, level).size for level in levels]
figure, axes = plt.subplots(figsize=(7, 3.5), layout="constrained")
axes.plot(levels, girths)
axes.set(xlabel="level of the function", ylabel="length of the level set", ylim=(0, None))
