"""Encodings of graphs, and data sets of shapes."""

import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("torch.nn", reason="torch is not installed: pip install 'eigenshape[torch]'")
import torch

import eigenshape as es
import eigenshape.torch as et

pytestmark = pytest.mark.filterwarnings(
    "ignore::FutureWarning"
)  # of torch_geometric, when it is loaded


@pytest.fixture(scope="module")
def geometric():
    return pytest.importorskip(
        "torch_geometric.data",
        reason="torch_geometric is not installed: pip install 'eigenshape[torch]'",
    )


def random_graph(geometric, n, seed):
    generator = np.random.default_rng(seed)
    upper = np.triu(generator.random((n, n)) < 0.2, 1)
    edges = torch.tensor(np.argwhere(upper | upper.T).T)
    return geometric.Data(edge_index=edges, num_nodes=n)


def renumbered(geometric, graph, seed):
    order = torch.randperm(graph.num_nodes, generator=torch.Generator().manual_seed(seed))
    return order, geometric.Data(edge_index=order[graph.edge_index], num_nodes=graph.num_nodes)


def test_encodings_do_not_depend_on_the_order_of_nodes(geometric):
    ring = torch.arange(12)
    both = torch.stack([torch.cat([ring, (ring + 1) % 12]), torch.cat([(ring + 1) % 12, ring])])
    graphs = [random_graph(geometric, n, n) for n in (5, 30, 47)]
    graphs.append(
        geometric.Data(edge_index=both, num_nodes=12)
    )  # with eigenvalues of multiplicity 2
    encode = et.ProjectorEncoding(6)
    torch.set_default_dtype(torch.float64)
    try:
        for graph in graphs:
            order, other = renumbered(geometric, graph, 1)
            one, two = encode(graph.clone()), encode(other)
            for name in ("projector_edges", "projector_eigenvalues"):
                torch.testing.assert_close(one[name], two[name], atol=1e-12, rtol=0)
            torch.testing.assert_close(
                one.projector_nodes, two.projector_nodes[order], atol=1e-12, rtol=0
            )
    finally:
        torch.set_default_dtype(torch.float32)


def test_encodings_are_entries_of_projectors(geometric):
    graph = random_graph(geometric, 20, 3)
    adjacency = np.zeros((20, 20))
    adjacency[tuple(graph.edge_index.numpy())] = 1
    roots = adjacency.sum(axis=1) ** -0.5
    values, vectors = np.linalg.eigh(np.eye(20) - adjacency * roots * roots[:, None])
    encoded = et.ProjectorEncoding(4)(graph)
    i, j = graph.edge_index.numpy()
    for group in range(4):
        projector = np.outer(vectors[:, group], vectors[:, group])
        np.testing.assert_allclose(encoded.projector_nodes[:, group], np.diag(projector), atol=1e-6)
        np.testing.assert_allclose(encoded.projector_edges[:, group], projector[i, j], atol=1e-6)
    np.testing.assert_allclose(encoded.projector_eigenvalues[0], values[:4], atol=1e-6)


def test_a_batch_is_encoded_as_its_graphs_are(geometric):
    graphs = [random_graph(geometric, n, n) for n in (30, 8, 30, 41)]
    # Two nodes, one edge: fewer groups than are asked for. And three nodes without an edge.
    graphs.append(geometric.Data(edge_index=torch.tensor([[0, 1], [1, 0]]), num_nodes=2))
    graphs.append(geometric.Data(edge_index=torch.zeros((2, 0), dtype=torch.int64), num_nodes=3))
    encode = et.ProjectorEncoding(5)
    together = encode(geometric.Batch.from_data_list([graph.clone() for graph in graphs]))
    alone = [encode(graph) for graph in graphs]
    for name in ("projector_nodes", "projector_edges", "projector_eigenvalues"):
        expected = torch.cat([graph[name] for graph in alone])
        torch.testing.assert_close(together[name], expected, atol=1e-6, rtol=0)
    torch.testing.assert_close(alone[4].projector_eigenvalues, torch.tensor([[0.0, 2, 0, 0, 0]]))
    torch.testing.assert_close(alone[5].projector_nodes[:, 0], torch.ones(3))


def test_graphs_that_have_no_laplacian_are_refused(geometric):
    def graph(*edges):
        return geometric.Data(edge_index=torch.tensor(edges).T, num_nodes=4)

    encode = et.ProjectorEncoding(2)
    with pytest.raises(es.InvalidParameterError, match="no edge to itself; node 2 has one"):
        encode(graph((0, 1), (1, 0), (2, 2)))
    with pytest.raises(
        es.InvalidParameterError, match=r"in both directions; \(2, 3\) is there without"
    ):
        encode(graph((0, 1), (1, 0), (2, 3)))
    with pytest.raises(es.InvalidParameterError, match="must have an edge_index"):
        encode(geometric.Data(x=torch.ones(3, 1)))
    with pytest.raises(es.InvalidParameterError, match="n_groups must be at least 1"):
        et.ProjectorEncoding(0)


def test_a_wrong_eigenpair_is_noticed(geometric, monkeypatch):
    def wrong(matrices):
        values, vectors = eigh(matrices)
        return values + 1e-9, vectors

    eigh = np.linalg.eigh
    monkeypatch.setattr(np.linalg, "eigh", wrong)
    with pytest.raises(es.ConvergenceError, match="Eigenpairs of graphs must have errors below"):
        et.ProjectorEncoding(2)(random_graph(geometric, 9, 0))


SCRIPT = """
import sys
import torch
from torch.utils.data import DataLoader
import eigenshape as es, eigenshape.torch as et

if __name__ == "__main__":
    done = []
    shapes = et.ShapeDataset(
        "meshes", "operators", k=6, workers=es.retrieval.Workers(count=1),
        callback=lambda n, of, name, error: done.append(name),
    )
    assert shapes.classes == ["balls", "rings"], shapes.classes
    assert [name for name, _ in shapes.failed] == ["rings/flat"], shapes.failed
    assert "k must lie in 1..3" in shapes.failed[0][1], shapes.failed
    loader = DataLoader(shapes, batch_size=3, collate_fn=et.join_shapes)
    (batch,) = loader
    assert batch.sizes == (42, 162, 24), batch.sizes
    assert batch.labels.tolist() == [0, 0, 1]
    assert batch.eigenvalues.shape == (3, 6)
    points = et.ShapeDataset(
        "meshes", "operators", k=6, workers=es.retrieval.Workers(count=1),
        labels=lambda item: es.read_mesh(item.path).vertices[:, 0] > 0,
    )
    assert len(points[0].labels) == 42
    print("right")
"""


@pytest.mark.long
def test_a_data_set_of_a_folder(tmp_path):
    meshes = {
        "balls/one": es.icosphere(1),
        "balls/two": es.icosphere(2),
        "rings/torus": es.shapes.torus(6, 4),
        "rings/flat": es.TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]),
    }
    for name, mesh in meshes.items():
        path = tmp_path / "meshes" / f"{name}.ply"
        path.parent.mkdir(parents=True, exist_ok=True)
        es.write_mesh(mesh, path)
    (tmp_path / "script.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.stdout == "right\n", done.stderr
    # One bundle for each file that has one; the second data set has added none.
    assert len(list((tmp_path / "operators").glob("*.npz"))) == 3
