"""
Copy labels from shape to shape
===============================

Name the parts of one shape by hand, and `es.transfer_labels` names those of another, also of another
pose and another mesh. Each label has a probability that it is right.
"""

import eigenshape as es

giraffe = es.make_creature("giraffe", n_vertices=1200)
parts = es.find_parts(giraffe).parts
labeled = es.retrieval.LabeledShape(giraffe, parts.labels)

other = es.make_creature("quadruped", 3, n_vertices=1200)
found = es.transfer_labels(labeled, other)
es.plot.figure_label_transfer(labeled, other, found)

# %%
# The mean confidence, weighted by area.

areas = es.geometry.face_areas(other)
print(f"{found.confidence @ areas / areas.sum():.0%} of the area is probably right")
