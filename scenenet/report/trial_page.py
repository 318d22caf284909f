"""The page of ``scenenet geneo try``: what a kernel responds to in a survey."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd

from scenenet.core.files import write_text
from scenenet.core.scratch import scratch_folder
from scenenet.figures import Picture
from scenenet.figures.plots.point_clouds import View, side_views
from scenenet.figures.plots.trials import answer_map
from scenenet.interpretability.workbench.trial import Place, Trial
from scenenet.report.blocks import Block, Column, Facts, Figure, Section, table, write
from scenenet.report.page import render

GENERATOR = "scenenet geneo try"
"""Mark of the page in its head."""

MAP_POINTS, AROUND_M, PICTURES = 60_000, 15.0, 4
"""Points of the map; planar distance in m that the picture of a place shows; number of these."""

PARAMETERS = (
    Column("name", "parameter"),
    Column("value", "value", "number"),
    Column("unit", "unit"),
    Column("low", "from", "number"),
    Column("high", "to", "number"),
    Column("meaning", "meaning"),
    Column("sentence", "this value", "sentence"),
)
CLASSES = (
    Column("code", "code", "plain"),
    Column("name", "class"),
    Column("points", "points", "count"),
    Column("mean", "mean response", "score"),
    Column("positive", "positive share", "score"),
    Column("highest", "highest", "score"),
)


def is_trial(path: Path) -> bool:
    """Whether the file is a page that ``write_trial_page`` wrote."""
    try:
        with path.open("rb") as stream:
            return f'name="generator" content="{GENERATOR}"'.encode() in stream.read(1000)
    except OSError:
        return False


def write_trial_page(trial: Trial, out: str | Path) -> None:
    """Write a trial as an HTML page that needs no other file and no network.

    Raises:
        OutputError: the page cannot be written.
    """
    e = trial.equivariance
    facts = [
        ("points", write(trial.points, "count")),
        ("occupied voxels", write(trial.voxels, "count")),
        ("voxel size [m]", write(trial.voxel_size, "metres")),
        ("error under shifts", f"{e.translation:.1e}"),
        ("error under quarter turns", f"{e.quarter_turn:.1e}"),
        (f"error at {e.between_degrees:g}°", write(e.between, "score2")),
        ("error of half a voxel", write(e.half_voxel, "score2")),
    ]
    with scratch_folder() as scratch:
        blocks: list[Block] = [Facts(facts)]
        if trial.parameters:
            rows = pd.DataFrame([asdict(p) for p in trial.parameters])
            blocks.append(table(rows, PARAMETERS, "The parameters that were tried."))
        classes = pd.DataFrame([asdict(c) for c in trial.classes])
        caption = "The response at the points of each class, before any training."
        blocks += [table(classes, CLASSES, caption), Figure(_map(trial, scratch))]
        sections = [Section("answers", f"{trial.kernel} on {Path(trial.survey).name}", blocks)]
        for number, place in enumerate(trial.places[:PICTURES], start=1):
            sections.append(_place(trial, number, place, scratch))
        title = f"What the kernel {trial.kernel} responds to"
        write_text(out, render(sections, title, GENERATOR))


def _map(trial: Trial, scratch: Path) -> Picture:
    some = slice(None, None, max(1, trial.points // MAP_POINTS))
    places = np.array([(p.x, p.y) for p in trial.places]).reshape(-1, 2)
    file = scratch / "map.png"
    alt = answer_map(trial.xyz[some, :2], trial.responses[some], places, file)
    caption = (
        "The survey from above, coloured by the response; the numbers are the places with the "
        "highest responses. x and y begin at the lowest coordinates."
    )
    return Picture(file, "Map of the responses", alt, caption, "answers")


def _place(trial: Trial, number: int, place: Place, scratch: Path) -> Section:
    apart = np.hypot(trial.xyz[:, 0] - place.x, trial.xyz[:, 1] - place.y)
    near = apart <= AROUND_M
    largest = max(float(trial.responses.max()), 1e-12)
    view = View(
        "response",
        (trial.responses[near] / largest).clip(0, 1),
        "probability",
        "share of the highest response",
    )
    file = scratch / f"place-{number}.png"
    alt = side_views(trial.xyz[near] - (place.x, place.y, 0.0), [view], file)
    facts = [
        ("x [m]", f"{place.x:.2f}"),
        ("y [m]", f"{place.y:.2f}"),
        ("z [m]", f"{place.z:.2f}"),
        ("response", write(place.response, "score")),
        ("class", f"{place.code} {place.name}".strip()),
    ]
    caption = f"All points within {AROUND_M:g} m, from the side. Negative responses are shown as 0."
    title = f"Place {number}"
    picture = Picture(file, title, alt, caption, f"place-{number}")
    return Section(f"place-{number}", title, [Facts(facts), Figure(picture)])
