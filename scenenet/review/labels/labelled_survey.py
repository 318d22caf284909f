"""A survey labelled by a review, as files that training and scoring read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.progress import track
from scenenet.core.unchanged import FileState
from scenenet.detection.measured_tower import MeasuredTower
from scenenet.pointcloud import add_dimensions
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.prediction.point_dimensions import TOWER_ID
from scenenet.review.found_list import FoundList
from scenenet.review.labels.added import VOXEL_M, measure_at, points_around
from scenenet.review.labels.points import chunks_of, predicted_files, states_of
from scenenet.review.labels.relabel import Codes, Relabelling
from scenenet.review.merge import Review


@dataclass(frozen=True)
class LabelFiles:
    """The files of a labelled survey.

    Attributes:
        files: file of the prediction -> the same points with labels.
        states: of the files of the prediction, before they are read.
    """

    files: Mapping[Path, Path]
    states: Mapping[Path, FileState]

    @classmethod
    def of(cls, found: FoundList, out: Path) -> LabelFiles:
        """The files for a prediction.

        Args:
            out: the file, ``.laz`` or ``.las``; a folder for a survey of several files.

        Raises:
            InputError: there are no points beside the list, they were classified by the prediction,
                or ``out`` has a wrong ending.
        """
        if found.classified:
            raise InputError(
                "its points were given class codes by --classify, so labels cannot be "
                "distinguished from what was found",
                file=found.path,
                remedy="Predict the survey again without --classify",
            )
        predicted = predicted_files(found)
        is_file = out.suffix.lower() in (".laz", ".las")
        if is_file != (len(predicted) == 1 and next(iter(predicted)).parent == found.path.parent):
            raise InputError(
                "a survey of several files is labelled into a folder"
                if is_file
                else "the labelled survey is a .laz or .las file",
                file=out,
                remedy="Choose another --labels",
            )
        files = {path: out if is_file else out / name for path, name in predicted.items()}
        return cls(files, states_of(predicted))


@dataclass(frozen=True)
class LabelledSurvey:
    """What became of the towers that were added.

    Attributes:
        review: with the measures of the added towers.
        unmeasured: ids of added towers at whose place no body stands; they have no label.
        tower_points: number of points labelled tower.
    """

    review: Review
    unmeasured: tuple[int, ...]
    tower_points: int


def measure_added(review: Review, found: FoundList, labels: LabelFiles) -> dict[int, MeasuredTower]:
    """The structures of the towers that a review adds, by id, where a body stands.

    Raises:
        InputError: a file cannot be read.
    """
    added = review.decided("added")
    if not added:
        return {}
    places = np.array([(tower.x, tower.y) for tower in added])
    around = points_around(places, chain.from_iterable(map(chunks_of, labels.files)))
    measured = {}
    for tower, place, points in zip(added, places, around, strict=True):
        structure = measure_at(place, points, found.voxel_size or VOXEL_M)
        if structure is not None:
            measured[tower.id] = structure
    return measured


def write_labels(
    review: Review,
    found: FoundList,
    labels: LabelFiles,
    partial: Mapping[Path, Path],
    scheme: ClassScheme,
    *,
    accept_rest: bool = False,
) -> LabelledSurvey:
    """Write a survey labelled by a review, and measure the towers that were added.

    Each file has all points of the prediction in order, with their classes changed where the review
    says so, and the dimension ``tower_id``.

    Args:
        partial: file of ``labels`` -> where it is written.
        scheme: of the class codes.
        accept_rest: whether towers without a decision are labelled too.

    Raises:
        InputError: a file cannot be read, or changed after its state was taken.
        OutputError: a file cannot be written.
    """
    codes = Codes.of(scheme)
    added = measure_added(review, found, labels)
    relabelling = Relabelling(review, added, codes, accept_rest=accept_rest)
    own: dict[int, int] = dict.fromkeys(added, 0)
    total = 0
    for source, target in track(list(labels.files.items()), "labels: files written"):
        for number, count in _write(source, partial[target], relabelling, labels.states[source]):
            total += count
            if number in own:
                own[number] += count
    towers = tuple(
        replace(tower, base=_base(tower.base, added[tower.id]), values={
            **tower.values, **_measures(tower.values, added[tower.id], own[tower.id]),
        })
        if tower.id in added
        else tower
        for tower in review.towers
    )  # fmt: skip
    unmeasured = tuple(t.id for t in review.decided("added") if t.id not in added)
    return LabelledSurvey(replace(review, towers=towers), unmeasured, total)


def _write(
    source: Path, target: Path, relabelling: Relabelling, state: FileState
) -> list[tuple[int, int]]:
    """Write a file; the number of points labelled tower for each tower id, 0 for those that only
    annotators labelled."""
    is_tower = relabelling.codes.towers
    labelled = [c.xyz[np.isin(c.codes, is_tower)] for c in chunks_of(source)]
    cleared = relabelling.cleared(np.concatenate([*labelled, np.empty((0, 3))]))
    counts: dict[int, int] = {}
    chunks = _changed(source, relabelling, cleared)
    current: list[np.ndarray] = []

    def values(xyz: np.ndarray) -> Mapping[str, np.ndarray]:
        codes, towers = next(chunks)
        current[:] = [codes]
        for number, count in zip(
            *np.unique(towers[np.isin(codes, is_tower)], return_counts=True), strict=True
        ):
            counts[int(number)] = counts.get(int(number), 0) + int(count)
        return {TOWER_ID: towers}

    dimension = {TOWER_ID: (np.uint32, "id of tower, 0 none")}
    # The file is read side by side in equal chunks: new values follow from what the points have.
    add_dimensions(source, target, dimension, values, state, lambda *_: current[0])
    return list(counts.items())


def _changed(
    source: Path, relabelling: Relabelling, cleared: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The class codes and towers of each chunk; ``cleared`` as ``Relabelling.cleared``."""
    at = 0
    for chunk in chunks_of(source):
        rows = np.flatnonzero(np.isin(chunk.codes, relabelling.codes.towers))
        ended = np.zeros(len(chunk.codes), bool)
        ended[rows] = cleared[at : at + len(rows)]
        at += len(rows)
        yield relabelling.apply(chunk, ended)


def _base(said: float | None, tower: MeasuredTower) -> float:
    return tower.base if said is None else said


def _measures(values: Mapping[str, object], tower: MeasuredTower, points: int) -> dict[str, object]:
    """What was measured of an added tower, for the columns of its list that no review gives."""
    measured = {
        "base": tower.base,
        "height": tower.height,
        "width": tower.width,
        "conductor_directions": len(tower.spans),
        "conductor_bearings": " ".join(f"{span.bearing:.1f}" for span in tower.spans),
        "points": points,
    }
    return {name: value for name, value in measured.items() if name in values
            and values[name] is None}  # fmt: skip
