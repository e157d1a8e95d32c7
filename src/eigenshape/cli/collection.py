"""eigenshape collection: specimens of a folder in correspondence, with landmarks and a report."""

from __future__ import annotations

from pathlib import Path

import typer

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import (
    SOME_FAILED,
    batch_reporter,
    err,
    escape_text,
    out,
    print_failures,
    print_json,
    print_written,
    progress_bar,
)
from eigenshape.cli.inputs import Memory, Timeout, Workers

MOST_NAMED = 5  # doubtful landmarks that a line names; the report has all


def collection(
    folder: Path,
    *,
    output: Path,
    landmarks: Path | None = None,
    unit: str = "mm",
    curve_points: int | None = None,
    template: str | None = None,
    unmirrored: bool = False,
    workers: Workers = None,
    timeout: Timeout = 300.0,
    memory: Memory = None,
    scheduler: str | None = None,
    as_json: bool = False,
) -> None:
    """Bring all specimens of a folder into correspondence, and transfer the landmarks of some to all.

    The output has the mean shape (mean.ply), the landmarks of all specimens (landmarks.csv), their
    sizes, sides and what was noticed (specimens.csv) and a page that any browser opens
    (report.html). If landmarks have curves, landmarks.sliders.csv has the rows of their points.
    A specimen that fails is named, and the others go on.
    After Ctrl-C or a crash the same command continues where it stopped; until it has ended, the
    output keeps the last collection that was finished (collection.sqlite). Where standard error is
    a file, it gets a line for each step of a specimen. The exit code is 3 if some specimens failed.

    For instance: eigenshape collection skulls -o skulls-out

    Parameters
    ----------
    folder
        Folder of surfaces of one form, such as bones. Landmarks beside a surface of the same name
        (NAME.mrk.json, NAME.fcsv, NAME.pp, NAME.landmarkAscii) are taken as known.
    output
        Write the collection to this folder, which is created if it does not exist.
    landmarks
        Known landmarks, instead of those in the folder: a table (.csv, .tps, .txt of Morphologika)
        that names specimens, or a folder of files such as NAME.mrk.json.
    unit
        Unit of the surfaces: m, cm, mm, um, nm or inch. Landmarks whose file names another one are
        converted to it.
    curve_points
        Space that many points evenly along each curve of the known landmarks, its ends included.
        Without this the points of curves stay those that were drawn.
    template
        Name of the specimen that is fitted to all others first. By default that of the collection in
        the output folder, or of a new one the specimen with the median area.
    unmirrored
        No specimen is a mirror image of another. Without this, mirror images are tried, and the
        landmarks of two or more specimens tell where both sides of the form are alike.
    workers
        Number of processes that fit specimens at the same time. By default one for each core.
    timeout
        Seconds after which a specimen is named as failed.
    memory
        Gigabytes that a process may use; a specimen that needs more is named as failed. By default
        each process has an equal share of the machine's memory.
    scheduler : ADDRESS
        Fit on a cluster: the address of a Dask scheduler, such as tcp://10.0.0.5:8786. Needs
        pip install 'eigenshape[cluster]' on all machines, and files that all of them see.
    """
    # Files that cannot be read are found now, and not after hours.
    labelled = steps.find_landmarks(folder, landmarks, output, unit, curve_points)
    with (
        steps.worker_processes(workers, timeout, memory, scheduler) as processes,
        progress_bar("collection") as progress,
    ):
        built = es.collections.build_collection(
            folder,
            output,
            template=template,
            mirrored=not unmirrored and (labelled or True),
            workers=processes,
            callback=batch_reporter(progress, "failed", lines=True),
        )
    known = {name: points for name, points in labelled.items() if name in built.names}
    written = ["mean.ply", "specimens.csv", "report.html"]
    carried = None
    warnings = [
        f"landmarks: the landmarks of {name} are not used, because it failed"
        for name in labelled
        if name not in known
    ]
    warnings += steps.unsure_sides(built)
    if known:
        carried = es.collections.carry_landmarks(built, known)
        warnings += [f"landmarks: {text}" for text in steps.mostly_doubtful(carried)]
        carried.save(output / "landmarks.csv")
        written.insert(2, "landmarks.csv")
        if carried.curves:
            written.insert(3, "landmarks.sliders.csv")
            es.morphometrics.write_landmarks(carried.landmarks, output / written[3])
    with progress_bar("report") as progress:
        title = folder.absolute().name
        steps.write_collection_report(built, carried, output / "report.html", title, progress)

    doubtful = {} if carried is None else steps.doubtful_landmarks(carried)
    if as_json:
        print_json(
            {
                "output": output,
                "specimens": built.names,
                "template": built.template,
                "sides": dict(zip(built.names, built.sides, strict=True)),
                "methods": dict(zip(built.names, built.methods, strict=True)),
                "labelled": list(known),
                "doubtful": doubtful,
                "notes": {name: notes for name, notes in built.notes.items() if notes},
                "warnings": warnings,
                "failures": built.failures,
            }
        )
    else:
        for name, notes in built.notes.items():
            if notes:
                out.print(f"  {escape_text(name)}: {escape_text('; '.join(notes))}")
        rows_of = {} if carried is None else steps.doubtful_in_short(carried)
        for name, rows in rows_of.items():
            first = ", ".join(rows[:MOST_NAMED]) + (", ..." if len(rows) > MOST_NAMED else "")
            out.print(f"  {escape_text(name)}: doubtful landmarks: {escape_text(first)}")
        print_failures(built.failures.items())
        rest = "; no landmarks were given."
        if carried is not None:
            rest = f", {len(known)} labelled; all have {len(carried.names)} landmarks now."
        out.print(f"{len(built.names)} specimens, {len(built.failures)} failed{rest}")
        for name in written:
            print_written(output / name)
    for warning in warnings:
        err.print(f"[yellow]{escape_text(warning)}[/]")
    if built.failures:
        raise typer.Exit(SOME_FAILED)
