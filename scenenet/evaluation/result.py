"""The scores of a model on crops, as types and as the JSON files under ``results/evaluate``.

A score that is not defined (``scenenet.metrics.score_columns``) is None, and null in the files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from scenenet.metrics.score_columns import ScoreFields
from scenenet.metrics.tower_matching import TowerMatch
from scenenet.metrics.voxel_scores import Confusion, VoxelScores
from scenenet.pointcloud.targets import TOWER


@dataclass(frozen=True)
class TowerScores:
    """Scores of detected towers against labelled or true ones.

    Attributes:
        precision, recall: of the detected towers.
        median_error_m: m, median planar position error of the true positives; None without any.
        median_height_error_m, median_base_error_m: m, median absolute error of their height, and of
            the elevation of the ground at their foot; None where it is known for none of them.
        n_true, n_predicted: number of labelled or true, and of detected towers.
    """

    precision: float | None
    recall: float | None
    median_error_m: float | None
    median_height_error_m: float | None
    median_base_error_m: float | None
    n_true: int
    n_predicted: int

    @classmethod
    def of(cls, match: TowerMatch) -> TowerScores:
        return cls(**match.scores())  # type: ignore[arg-type]


@dataclass(frozen=True)
class PointScores:
    """Scores of points: those with a tower id against those that are tower.

    Attributes:
        precision, recall, iou: of the points with a tower id; None as for voxels.
        n_true, n_predicted: number of tower points, and of points with a tower id.
        n_points: number of all points.
    """

    precision: float | None
    recall: float | None
    iou: float | None
    n_true: int
    n_predicted: int
    n_points: int

    @property
    def of_every_point(self) -> PointScores:
        """Of the trivial answer for the same points, that each of them is the target."""
        return PointScores.of(Confusion(tp=self.n_true, fp=self.n_points - self.n_true))

    @classmethod
    def of(cls, counts: Confusion) -> PointScores:
        return cls(
            precision=counts.precision,
            recall=counts.recall,
            iou=counts.iou_tower,
            n_true=counts.tp + counts.fn,
            n_predicted=counts.tp + counts.fp,
            n_points=counts.tp + counts.fp + counts.fn + counts.tn,
        )


@dataclass(frozen=True)
class _Sample:
    id: str


@dataclass(frozen=True)
class SampleScores(ScoreFields, _Sample):
    """The scores of one crop; ``_Sample`` puts its id first in files.

    Attributes:
        id: of the crop.
        tp, fp, fn, tn: numbers of voxels.
        towers_true, towers_predicted: number of labelled or true, and of detected towers.
        position_error_m: m, smallest position error of a true positive; None without any.
        f05_observer, f05_towers: F0.5 of the voxels at or above tau, and of whole towers.
        points: scores of its points; None where they were not counted.
    """

    tp: int
    fp: int
    fn: int
    tn: int
    towers_true: int
    towers_predicted: int
    position_error_m: float | None
    f05_observer: float | None
    f05_towers: float | None
    points: PointScores | None


_VOXELS = ("voxel", "voxel_observer", "voxel_towers", "voxel_trivial", "voxel_occupied")


@dataclass(frozen=True)
class Scores:
    """The scores of a model on crops, against the labels or against the truth.

    Attributes:
        voxel: ``voxel_towers`` or ``voxel_observer``, depending on ``Evaluation.whole_towers``.
        voxel_observer: scores of the voxels at or above tau.
        voxel_towers: scores of the voxels of the detected towers with their bodies.
        voxel_trivial: scores of a model that predicts no tower.
        voxel_occupied: ``voxel`` over the occupied voxels only.
        towers: scores of the detected towers.
        points: scores of the points with a tower id; None where they were not counted.
        per_sample: scores of each crop.
        pr_curve: tau, precision, recall and f05 at every threshold.
        average_precision: area under the precision-recall curve.
    """

    voxel: VoxelScores
    voxel_observer: VoxelScores
    voxel_towers: VoxelScores
    voxel_trivial: VoxelScores
    voxel_occupied: VoxelScores
    towers: TowerScores
    points: PointScores | None
    per_sample: tuple[SampleScores, ...]
    pr_curve: dict[str, list[float | None]]
    average_precision: float | None

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Scores:
        """The scores as ``dataclasses.asdict`` gives them.

        Raises:
            KeyError, TypeError: a score is missing or unknown.
        """
        values = {f.name: data[f.name] for f in fields(Scores)}
        if data["towers"] is None:  # of another target than towers
            voxel = VoxelScores(**data["voxel"])
            of_none = VoxelScores.of(Confusion(), voxel.tau, voxel.n_samples)
            data = {**data, "voxel_towers": asdict(of_none)}
            data["towers"] = asdict(TowerScores.of(TowerMatch.none()))
        values |= {name: VoxelScores(**data[name]) for name in _VOXELS}
        values["towers"] = TowerScores(**data["towers"])
        values["points"] = _points(data["points"])
        values["per_sample"] = tuple(
            SampleScores(**{**row, "points": _points(row["points"])}) for row in data["per_sample"]
        )
        return Scores(**values)


@dataclass(frozen=True)
class Evaluation(Scores):
    """The scores of a model on crops: those of ``Scores`` are against the labels.

    Attributes:
        model, seed: name and seed of the model.
        alive: whether any voxel labelled tower is at or above tau; a model without one is dead.
        whole_towers: whether ``voxel`` and ``per_sample`` count the voxels of whole towers.
        truth: scores against the truth, on the crops whose truth is known; None without any.
        labels_against_truth: scores of the labels themselves against the truth, counted on the
            points of ``truth.points``; None where those are.
        target: what the model finds (``scenenet.pointcloud.targets``). Towers and their voxels are
            null in the files for anything but towers.
        part: part of the split; None without a split.
        parameters: number of parameters; None if the model file has it.
    """

    model: str
    seed: int | None
    alive: bool
    whole_towers: bool
    truth: Scores | None
    labels_against_truth: PointScores | None
    target: str = TOWER.text
    part: str | None = None
    parameters: int | None = None

    @property
    def labels(self) -> Scores:
        """The scores against the labels alone."""
        return Scores(**{f.name: getattr(self, f.name) for f in fields(Scores)})

    @property
    def leading(self) -> Scores:
        """The scores against the truth where it is known, else those against the labels."""
        return self.truth or self

    def to_json(self) -> dict[str, Any]:
        """Plain values, without ``part`` and ``parameters`` if they are None, and without a
        ``target`` that is the tower."""
        values = asdict(self)
        target = values.pop("target")
        for scores in (values, values["truth"] or {}):
            if "per_sample" in scores:
                scores["per_sample"] = list(scores["per_sample"])
                if target != TOWER.text:
                    scores |= {"towers": None, "voxel_towers": None}
        if target != TOWER.text:
            values = {"target": target} | values
        first = ("part", "parameters", "model", "seed", "alive", "whole_towers")
        last = ("truth", "labels_against_truth")
        own = {name: values.pop(name) for name in (*first, *last)}
        head = {n: own[n] for n in first if own[n] is not None or n not in first[:2]}
        return head | values | {name: own[name] for name in last}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Evaluation:
        """The evaluation from the result of ``to_json``.

        Raises:
            KeyError, TypeError: a score is missing or unknown.
        """
        labels = Scores.from_json(data)
        return cls(
            **{f.name: getattr(labels, f.name) for f in fields(Scores)},
            **{name: data[name] for name in ("model", "seed", "alive", "whole_towers")},
            truth=None if data["truth"] is None else Scores.from_json(data["truth"]),
            labels_against_truth=_points(data["labels_against_truth"]),
            target=data.get("target", TOWER.text),
            part=data.get("part"),
            parameters=data.get("parameters"),
        )


def _points(data: Mapping[str, Any] | None) -> PointScores | None:
    return None if data is None else PointScores(**data)
