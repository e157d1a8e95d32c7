import ast
from pathlib import Path

import eigenshape

HERE = Path(eigenshape.__file__)
PROMISED = {
    "read_mesh", "write_mesh", "TriangleMesh", "partial_scan", "cut_by_planes", "make_creature", "cotangent_laplacian",
    "solve_spectrum", "heat_kernel_signature", "merge_tree", "segment", "describe", "matching_score", "ShapeIndex",
}  # fmt: skip


def test_all_names_what_is_imported_and_nothing_else():
    tree = ast.parse(HERE.read_text())
    imported = {name.name for node in tree.body if isinstance(node, ast.ImportFrom) for name in node.names}
    assert set(eigenshape.__all__) == imported
    assert len(set(eigenshape.__all__)) == len(eigenshape.__all__)


def test_promised_names_are_there():
    assert set(eigenshape.__all__) >= PROMISED


def test_every_error_stands_in_the_tree():
    module = ast.parse((HERE.parent / "_errors.py").read_text())
    drawn = ast.get_docstring(module)
    classes = [node.name for node in module.body if isinstance(node, ast.ClassDef)]
    assert classes
    assert all(name in drawn for name in classes)
