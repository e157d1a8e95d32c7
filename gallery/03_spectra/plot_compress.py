"""
A small file with a hidden mark
===============================

Spectral coefficients can be rounded, which makes small files, and moved a little, which hides a mark
that only the owner of a key can find.
"""

import matplotlib.pyplot as plt

import eigenshape as es

original = es.make_creature("bird", n_vertices=1500)
sizes, errors = [], []
for bits in (8, 10, 12, 14, 16):
    packed = es.spectral.compress_mesh(original, bits=bits)
    sizes.append(8 * len(packed.data) / original.n_vertices)
    errors.append(packed.max_error)
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
axes.semilogy(sizes, errors, "o-")
axes.set(xlabel="bits per vertex, faces included", ylabel="largest error, length")
axes.grid(alpha=0.3)

# %%
# A file of 32-bit numbers takes about 96 bits per vertex and 192 for its faces.
#
# The mark is found in the file that was packed and unpacked, and nowhere else. Vertices come back in
# another order, so they are put back first.

marked = es.spectral.embed_watermark(original, "a secret of the owner")
packed = es.spectral.compress_mesh(marked, bits=12)
points = marked.vertices.copy()
points[packed.vertex_order] = es.spectral.decompress_mesh(packed.data).vertices
for key in ("a secret of the owner", "a guess"):
    test = es.spectral.detect_watermark(original, (points, original.faces), key)
    print(f"{key!r}: score {test.score:.2f}, chance of a false alarm {test.false_alarm:.1g}")
