"""eigenshape index learn: learn one codebook for indexes that are built in parts."""

from __future__ import annotations

from pathlib import Path

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import err, print_written
from eigenshape.cli.index.add import Memory, Timeout, Workers
from eigenshape.cli.inputs import repair_names


def learn(
    sources: list[Path],
    *,
    output: Path,
    repair: str = "auto",
    workers: Workers = None,
    timeout: Timeout = 300.0,
    memory: Memory = None,
    scheduler: str | None = None,
) -> None:
    """Learn a codebook from meshes, for indexes that are built in parts.

    At most 100 meshes are read. Shapes with different codebooks do not compare, so learn one and
    pass it to every `eigenshape index add --part` with --codebook.

    Parameters
    ----------
    output
        Write the codebook (NPZ).
    """
    repairs = repair_names(repair)
    steps.require_output(output, (".npz",), "A codebook")
    items = es.io.find_items(sources)
    with steps.worker_processes(workers, timeout, memory, scheduler) as processes:
        codebook = steps.learn_codebook(items, processes, repairs)
    if codebook == es.retrieval.default_codebook():
        err.print(
            "there are too few shapes to learn from; this is the codebook that comes with eigenshape"
        )
    output.write_bytes(es.retrieval.write_codebook(codebook))
    print_written(output)
