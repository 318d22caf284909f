"""Explanation of each detected tower: the share of each GENEO (thesis 5.2.3, Figure 5.6)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from scenenet.detection.survey_tower import SurveyTower
from scenenet.geneo import kernel_named
from scenenet.interpretability.doubts import Units, survey_doubts
from scenenet.line.notes import LineNote
from scenenet.models.base import VoxelModel
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.model_file import ModelCard
from scenenet.pointcloud.units import METRE

NEGLIGIBLE = 0.01
"""Absolute share of a GENEO below which the explanation does not state its side."""

UNDETERMINED = (
    "not determined: other values fit the training crops as well, so do not read it as a size"
)
"""What stands in place of the meaning of a number that could as well have another value."""


@dataclass(frozen=True)
class TowerExplanation:
    """The reasons for one tower.

    Attributes:
        id: number in the tower list.
        x, y: in the CRS and the units of the survey.
        height: above the ground at its foot, in the unit of its heights.
        unit, vertical_unit: names of these units.
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
    unit: str
    vertical_unit: str
    probability: float
    evidence: tuple[str, ...]
    contributions: tuple[tuple[str, float, str], ...]
    doubts: tuple[str, ...]


def explanations(
    towers: Sequence[SurveyTower],
    card: ModelCard,
    unit_sizes: tuple[float, float, float] = (1.0, 1.0, 1.0),
    unit_names: tuple[str, str, str] = (METRE, METRE, METRE),
    notes: Iterable[LineNote] = (),
) -> list[TowerExplanation]:
    """An explanation of every tower of a survey, in the units of the survey.

    The contributions are empty for a model without GENEOs.

    Args:
        unit_sizes, unit_names: sizes in m of the units of x, y and z, and their names.
        notes: as ``survey_doubts``.
    """
    units = Units(*unit_sizes[1:], *unit_names[1:])
    reasons = survey_doubts(towers, card.tau, unit_sizes, unit_names, notes)
    return [_explanation(t, own, units) for t, own in zip(towers, reasons, strict=True)]


def _explanation(tower: SurveyTower, doubts: tuple[str, ...], units: Units) -> TowerExplanation:
    shares = sorted(tower.contributions.items(), key=lambda item: -abs(item[1]))
    return TowerExplanation(
        tower.id,
        tower.x,
        tower.y,
        tower.height,
        units.planar_name,
        units.vertical_name,
        tower.probability,
        _evidence(tower, units),
        tuple((name, share, _sentence(share)) for name, share in shares),
        doubts,
    )


def _evidence(tower: SurveyTower, units: Units) -> tuple[str, ...]:
    """The measurements of a tower, in words."""
    bearings = sorted(tower.conductor_bearings)
    conductors = "no conductors were found that leave it"
    if bearings:
        towards = " and ".join(f"{bearing:.0f}°" for bearing in bearings)
        conductors = f"conductors leave its head at bearings of {towards} from north"
    return (
        f"it is {tower.height:.0f} {units.vertical} tall, on ground at {tower.base:.0f} "
        f"{units.vertical}",
        f"its body is {tower.width:.1f} {units.planar} wide where nothing touches it",
        conductors,
    )


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
