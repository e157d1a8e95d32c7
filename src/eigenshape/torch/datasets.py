"""A torch data set of the shapes in a folder, with their operators."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from torch.utils.data import Dataset

from certeig.kit.progress import Callback
from certeig.kit.typing import Integer
from eigenshape._workers import Item, Workers
from eigenshape.io.folders import find_items
from eigenshape.io.shape_files import read_shape
from eigenshape.spectral.tools.bundle import cache_operator_bundles, operator_bundle
from eigenshape.torch.shapes import ShapeTensors, shape_tensors


class ShapeDataset(Dataset):  # type: ignore[misc]
    """The shapes of a folder with their operators, for a DataLoader.

    The operators are computed in worker processes, once for each content of a file, and kept in a
    folder; after an interruption the same call computes what is missing. A file that fails is
    listed and left out. Pass `join_shapes` as `collate_fn` to the DataLoader.

    Parameters
    ----------
    folder : path
        Searched as by `es.io.find_items`.
    cache : path
        Folder for the operators.
    k : int
        Number of eigenpairs.
    labels : callable, optional
        Return the labels of an item, such as one number for each point. By default the label is the
        number of the item's class, the folder that holds its file.
    operator : str, optional
        As of `es.spectral.operator_bundle`; "robust" takes triangles of any quality.
    workers : Workers
    callback : callable, optional
        Called as callback(n_done, n_items, name, error or None) after each file.

    Attributes
    ----------
    items : list of Item
    classes : list of str
        Names of the classes, ascending.
    failed : tuple of (str, str)
        Name and reason of each file that failed.

    Raises
    ------
    InvalidParameterError, EigenshapeError
        As in `es.io.find_items` and `es.spectral.cache_operator_bundles`. A script must make a data
        set under ``if __name__ == "__main__":``, since workers import the script.

    Examples
    --------
    ::

        shapes = et.ShapeDataset("meshes", "operators", k=64)
        for batch in DataLoader(shapes, batch_size=4, shuffle=True, collate_fn=et.join_shapes):
            loss = criterion(network(batch.points, batch), batch.labels)
    """

    def __init__(  # noqa: PLR0913 - one keyword for each choice of a batch
        self,
        folder: str | Path,
        cache: str | Path,
        k: Integer = 128,
        *,
        labels: Callable[[Item], Any] | None = None,
        operator: str | None = None,
        workers: Workers = Workers(),
        callback: Callback | None = None,
    ) -> None:
        found = find_items(folder)
        choices: dict[str, Any] = {"operator": operator, "workers": workers, "callback": callback}
        self.failed = cache_operator_bundles(found, read_shape, cache, k, **choices)
        without = {name for name, _ in self.failed}
        self.items = [item for item in found if item.name not in without]
        self.classes = sorted({item.label for item in self.items if item.label is not None})
        self._cache, self._k, self._operator, self._labels = cache, k, operator, labels

    def __len__(self) -> int:
        return len(self.items)

    def __getitem__(self, number: int) -> ShapeTensors:
        """Read a shape, and its operators from the folder."""
        item = self.items[number]
        shape = read_shape(item.path)
        bundle = operator_bundle(shape, self._k, operator=self._operator, cache=self._cache)
        if self._labels is not None:
            return shape_tensors(shape, bundle, self._labels(item))
        return shape_tensors(
            shape, bundle, None if item.label is None else self.classes.index(item.label)
        )
