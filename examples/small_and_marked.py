"""A mesh as a small file, with a watermark that survives the way there and back."""

from pathlib import Path
from tempfile import TemporaryDirectory

import eigenshape as es

KEY = "a secret of the owner"


def main(folder: Path) -> es.spectral.WatermarkTest:
    """Mark a torus, write it to a small file, read it back, and look for the mark."""
    original = es.shapes.torus(40, 24)
    marked = es.spectral.embed_watermark(original, KEY)

    packed = es.spectral.compress_mesh(marked, bits=12)
    path = folder / "torus.esz"
    path.write_bytes(packed.data)
    print(f"{8 * len(packed.data) / marked.n_vertices:.1f} bits a vertex, faces included")

    # vertices come back in another order, and detection needs theirs
    again = es.spectral.decompress_mesh(path.read_bytes())
    points = marked.vertices.copy()
    points[packed.vertex_order] = again.vertices
    test = es.spectral.detect_watermark(original, (points, original.faces), KEY)
    print(f"score {test.score:.2f}; chance of a false alarm {test.false_alarm:.1g}")

    # the lines where an eigenfunction is zero, and how many regions they separate
    spectrum = es.solve_spectrum(es.cotangent_laplacian(original), 6)
    mode = spectrum.eigenvectors[:, 5]
    n_domains = es.spectral.nodal_domains(original, mode).n_domains
    length = es.spectral.nodal_set(original, mode).size
    print(f"mode 5: {n_domains} nodal domains, lines of length {length:.1f}")
    return test


if __name__ == "__main__":
    with TemporaryDirectory() as temporary:
        main(Path(temporary))
