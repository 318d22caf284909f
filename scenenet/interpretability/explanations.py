"""Explanation of each detected tower: the share of each GENEO (thesis 5.2.3, Figure 5.6)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from scenenet.detection.conductor_rules import FAR
from scenenet.detection.survey_tower import SurveyTower
from scenenet.geneo import kernel_named
from scenenet.models.base import VoxelModel
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.model_file import ModelCard

NEGLIGIBLE = 0.01
"""Absolute share of a GENEO below which the explanation does not state its side."""

UNDETERMINED = "no meaning: the training crops do not determine it"
"""What stands in place of the meaning of a number that could as well have another value."""


@dataclass(frozen=True)
class TowerExplanation:
    """The reasons for one tower.

    Attributes:
        id: number in the tower list.
        x, y: m, in the CRS of the survey.
        height: m above the ground at its foot.
        probability: highest probability of its voxels.
        evidence: measurements at its position, independent of the model.
        contributions: (GENEO, share, sentence), the largest first. Positive shares support a
            tower, negative ones oppose it; their absolute values sum to about one.
        doubts: reasons for a person to check the tower.
    """

    id: int
    x: float
    y: float
    height: float
    probability: float
    evidence: tuple[str, ...]
    contributions: tuple[tuple[str, float, str], ...]
    doubts: tuple[str, ...]


def explanations(towers: Iterable[SurveyTower], card: ModelCard) -> list[TowerExplanation]:
    """An explanation of every tower of a survey.

    The contributions are empty for a model without GENEOs.
    """
    return [_explanation(tower, card) for tower in towers]


def _explanation(tower: SurveyTower, card: ModelCard) -> TowerExplanation:
    shares = sorted(tower.contributions.items(), key=lambda item: -abs(item[1]))
    return TowerExplanation(
        tower.id,
        tower.x,
        tower.y,
        tower.height,
        tower.probability,
        _evidence(tower),
        tuple((name, share, _sentence(share)) for name, share in shares),
        _doubts(tower, card.tau),
    )


def _evidence(tower: SurveyTower) -> tuple[str, ...]:
    """The measurements of a tower, in words."""
    bearings = sorted(tower.conductor_bearings)
    conductors = "no conductors were found that leave it"
    if bearings:
        towards = " and ".join(f"{bearing:.0f}°" for bearing in bearings)
        conductors = f"conductors leave its head at bearings of {towards} from north"
    return (
        f"it is {tower.height:.0f} m tall, on ground at {tower.base:.0f} m",
        f"its body is {tower.width:.0f} m wide where nothing touches it",
        conductors,
    )


def _doubts(tower: SurveyTower, tau: float | None) -> tuple[str, ...]:
    doubts = []
    if tower.edge_distance < tower.height:
        doubts.append(
            f"it is {tower.edge_distance:.0f} m from the edge of the data, less than its height: "
            "part of it may be missing"
        )
    if tower.conductor_directions == 1 and tower.edge_distance >= FAR:
        doubts.append("conductors leave it in one direction only: the end of a line, or no tower")
    if tau is not None and tower.probability < tau:
        doubts.append(
            f"its probability is below tau, {tau:.3f}: its conductors and its body support it"
        )
    elif tau is not None and tower.probability < (1 + tau) / 2:
        doubts.append(f"its probability is not far above tau, {tau:.3f}")
    return tuple(doubts)


def _sentence(share: float) -> str:
    if abs(share) < NEGLIGIBLE:
        return f"contributed less than {NEGLIGIBLE:.0%}"
    side = "supports a tower" if share > 0 else "opposes a tower"
    return f"{side}, {abs(share):.0%} of the observer"


def meanings(model: VoxelModel, card: ModelCard) -> list[tuple[str, float, str, str]]:
    """Every number of a SCENE-Net as (name, value, unit, meaning); none for a CNN.

    The unit of a length in voxels includes the length of a voxel in metres. A number of which the
    training crops do not determine the value has ``UNDETERMINED`` as its meaning.
    """
    if not isinstance(model, GeneoModel):
        return []
    values = model.shape_parameters()
    evidence = model.evidence if isinstance(model, MetricSceneNet) else {}

    def row(label: str, shown: str, unit: str, meaning: str) -> tuple[str, float, str, str]:
        known = label not in evidence or evidence[label].determined
        return shown, values[label], unit, meaning if known else UNDETERMINED

    rows = []
    for name, geneo in zip(model.names, model.geneos, strict=True):
        for parameter in kernel_named(geneo).parameters:
            label = f"{name}.{parameter.name}"
            unit = model.unit_of(parameter)
            if unit == "voxel":
                unit = f"voxel = {values[label] * card.voxel_size:.2f} m"
            rows.append(row(label, f"{name} {parameter.name}", unit, parameter.meaning))
    for name in model.names:
        meaning = f"weight of the {name} in the observer"
        rows.append(row(f"lambda.{name}", f"lambda {name}", "1", meaning))
    return rows
