"""
Limbs, head and trunk
=====================

`es.find_parts` cuts a surface where people would: where little heat flows from one part to the next.
Nothing is trained.
"""

import numpy as np

import eigenshape as es

giraffe = es.make_creature("giraffe", 1, n_vertices=2500)
found = es.find_parts(giraffe)
es.figure_segments(giraffe, found.parts.labels, found.parts.features.vertices)

# %%
# The tree of parts can be cut anywhere without new computation.

panels = []
for n_parts in (3, 6, 12):
    parts = es.segment(found.tree, n_regions=n_parts)
    panels.append(es.plot.Panel(giraffe, f"{n_parts} parts", parts.labels, np.empty(0, dtype=int)))
es.plot.figure_contact_sheet(panels[0], panels[1:])

# %%
# In the window of the studio the number of parts follows a slider; here on another shape.
#
# .. turning:: biped
#    :panel: parts
