"""The scores of a model on crops, as types and as the JSON files under ``results/evaluate``.

A score that is not defined (``scenenet.metrics.score_columns``) is None, and null in the files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from scenenet.metrics.tower_matching import TowerMatch
from scenenet.metrics.voxel_scores import Confusion


@dataclass(frozen=True)
class VoxelScores:
    """Voxel scores at tau over all crops.

    Attributes:
        precision, recall, f05, iou_tower: of the tower class.
        miou: mean IoU over background and tower.
        tau: the threshold.
        n_samples: number of crops.
    """

    precision: float | None
    recall: float | None
    f05: float | None
    iou_tower: float | None
    miou: float | None
    tau: float
    n_samples: int

    @classmethod
    def of(cls, counts: Confusion, tau: float, n_samples: int) -> VoxelScores:
        return cls(**counts.scores(), tau=tau, n_samples=n_samples)


@dataclass(frozen=True)
class TowerScores:
    """Scores of detected towers against labelled ones.

    Attributes:
        precision, recall: of the detected towers.
        median_error_m: m, median planar position error of the true positives; None without any.
        n_true, n_predicted: number of labelled and of detected towers.
    """

    precision: float | None
    recall: float | None
    median_error_m: float | None
    n_true: int
    n_predicted: int

    @classmethod
    def of(cls, match: TowerMatch) -> TowerScores:
        return cls(**match.scores())  # type: ignore[arg-type]


@dataclass(frozen=True)
class SampleScores:
    """The scores of one crop.

    Attributes:
        id: of the crop.
        precision, recall, f05, iou_tower, miou: as in ``VoxelScores``.
        tp, fp, fn, tn: numbers of voxels.
        towers_true, towers_predicted: number of labelled and of detected towers.
        position_error_m: m, smallest position error of a true positive; None without any.
        f05_observer, f05_towers: F0.5 of the voxels at or above tau, and of whole towers.
    """

    id: str
    precision: float | None
    recall: float | None
    f05: float | None
    iou_tower: float | None
    miou: float | None
    tp: int
    fp: int
    fn: int
    tn: int
    towers_true: int
    towers_predicted: int
    position_error_m: float | None
    f05_observer: float | None
    f05_towers: float | None


@dataclass(frozen=True)
class Evaluation:
    """The scores of a model on crops.

    Attributes:
        model, seed: name and seed of the model.
        alive: whether any tower voxel is at or above tau; a model without one is dead.
        whole_towers: whether ``voxel`` and ``per_sample`` count the voxels of whole towers.
        voxel: ``voxel_towers`` or ``voxel_observer``, depending on ``whole_towers``.
        voxel_observer: scores of the voxels at or above tau.
        voxel_towers: scores of the voxels of the detected towers with their bodies.
        voxel_trivial: scores of a model that predicts no tower.
        voxel_occupied: ``voxel`` over the occupied voxels only.
        towers: scores of the detected towers.
        per_sample: scores of each crop.
        pr_curve: tau, precision, recall and f05 at every threshold.
        average_precision: area under the precision-recall curve.
        part: part of the split; None without a split.
        parameters: number of parameters; None if the model file has it.
    """

    model: str
    seed: int | None
    alive: bool
    whole_towers: bool
    voxel: VoxelScores
    voxel_observer: VoxelScores
    voxel_towers: VoxelScores
    voxel_trivial: VoxelScores
    voxel_occupied: VoxelScores
    towers: TowerScores
    per_sample: tuple[SampleScores, ...]
    pr_curve: dict[str, list[float | None]]
    average_precision: float | None
    part: str | None = None
    parameters: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain values; ``part`` and ``parameters`` come first, unless they are None."""
        values = asdict(self)
        values["per_sample"] = list(values["per_sample"])
        optional = {name: values.pop(name) for name in ("part", "parameters")}
        return {name: value for name, value in optional.items() if value is not None} | values

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Evaluation:
        """The evaluation from the result of ``to_json``.

        Raises:
            KeyError, TypeError: a score is missing or unknown.
        """
        optional = {"part": data.get("part"), "parameters": data.get("parameters")}
        values = {f.name: data[f.name] for f in fields(cls) if f.name not in optional} | optional
        for name in ("voxel", "voxel_observer", "voxel_towers", "voxel_trivial", "voxel_occupied"):
            values[name] = VoxelScores(**data[name])
        values["towers"] = TowerScores(**data["towers"])
        values["per_sample"] = tuple(SampleScores(**row) for row in data["per_sample"])
        return cls(**values)
