"""Why a tower was called one: who contributed what (thesis 5.2.3, Figure 5.6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenenet.detection.conductors import FAR
from scenenet.geneo import kernel_named
from scenenet.models.base import VoxelModel
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.model_file import ModelCard

SILENT = 0.01
"""A GENEO with a smaller share said nothing that a person would want to read."""


@dataclass(frozen=True)
class Receipt:
    """The reason for one tower.

    Attributes:
        id: number in the tower list.
        x, y: m, in the survey's CRS.
        height: m above the ground at its foot.
        probability: of its most certain voxel.
        evidence: what was measured there that speaks for a tower, whatever the model says.
        contributions: (GENEO, share, sentence), the largest first. Positive shares speak for a
            tower, negative ones against; their absolute values sum to about one.
        doubts: what should make a person look again.
    """

    id: int
    x: float
    y: float
    height: float
    probability: float
    evidence: tuple[str, ...]
    contributions: tuple[tuple[str, float, str], ...]
    doubts: tuple[str, ...]


def receipts(geojson: Mapping[str, Any], model: VoxelModel, card: ModelCard) -> list[Receipt]:
    """A receipt for every tower of a list that ``scenenet.prediction.predict`` has written.

    A model without GENEOs gives receipts without contributions: it has no parts with a meaning.
    """
    return [_receipt(feature, model, card) for feature in geojson["features"]]


def _receipt(feature: Mapping[str, Any], model: VoxelModel, card: ModelCard) -> Receipt:
    facts = feature["properties"]
    shares = sorted(facts["contributions"].items(), key=lambda item: -abs(item[1]))
    doubts = []
    if facts["edge_distance"] < facts["height"]:
        doubts.append(
            f"{facts['edge_distance']:.0f} m from the edge of the data, nearer than it is tall: "
            "it may be cut off"
        )
    if facts["wire_directions"] == 1 and facts["edge_distance"] >= FAR:
        doubts.append("wires leave it in one direction only: the end of a line, or no tower")
    if card.tau is not None and facts["probability"] < card.tau:
        doubts.append(
            f"its probability stays under tau, {card.tau:.3f}: its wires and its body speak for it"
        )
    elif card.tau is not None and facts["probability"] < (1 + card.tau) / 2:
        doubts.append(f"its probability is not far above tau, {card.tau:.3f}")
    x, y = feature["geometry"]["coordinates"][:2]
    return Receipt(
        facts["id"],
        x,
        y,
        facts["height"],
        facts["probability"],
        _evidence(facts),
        tuple((name, share, _sentence(name, share, model)) for name, share in shares),
        tuple(doubts),
    )


def _evidence(facts: Mapping[str, Any]) -> tuple[str, ...]:
    """What was measured of a tower, in words."""
    bearings = sorted(facts["wire_bearings"])
    wires = "no wires are seen to leave it"
    if bearings:
        towards = " and ".join(f"{bearing:.0f}°" for bearing in bearings)
        wires = f"wires leave its head towards {towards} from north"
    return (
        f"it stands {facts['height']:.0f} m tall on the ground at {facts['base_elevation']:.0f} m",
        f"its body is {facts['width']:.0f} m wide where nothing touches it",
        wires,
    )


def _sentence(name: str, share: float, model: VoxelModel) -> str:
    if abs(share) < SILENT:
        return "had next to nothing to say here"
    side = "speaks for a tower" if share > 0 else "speaks against one"
    return f"{side}, {abs(share):.0%} of the answer"


def meanings(model: VoxelModel, card: ModelCard) -> list[tuple[str, float, str, str]]:
    """Every number of a SCENE-Net as (name, value, unit, meaning); none for a CNN.

    Lengths are in metres too, at the voxel size that surveys are predicted at.
    """
    if not isinstance(model, GeneoModel):
        return []
    values = model.shape_parameters()
    rows = []
    for name, geneo in zip(model.names, model.geneos, strict=True):
        for parameter in kernel_named(geneo).parameters:
            value = values[f"{name}.{parameter.name}"]
            unit = model.unit_of(parameter)
            if unit == "voxel":
                unit = f"voxel = {value * card.voxel_size:.2f} m"
            rows.append((f"{name} {parameter.name}", value, unit, parameter.meaning))
    rows += [
        (f"lambda {name}", values[f"lambda.{name}"], "1", f"weight of the {name} in the answer")
        for name in model.names
    ]
    return rows


def read_receipts(geojson: str | Path, model: str | Path) -> list[Receipt]:
    """Receipts from files."""
    from scenenet.core.files import read_json
    from scenenet.models.model_file import read_model

    return receipts(read_json(geojson), *read_model(model))
