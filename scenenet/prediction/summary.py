"""The summary of a prediction, as a type and as the JSON file beside the classified survey.

It imports neither torch nor the models, so that figures and the report do not depend on them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

SUMMARY = ".summary.json"
"""What follows the name of the survey in the name of its summary."""


@dataclass(frozen=True)
class PredictionSummary:
    """The summary of a prediction (``NAME.summary.json``).

    Attributes:
        survey: path of the survey, as given.
        model: name of the model.
        points: number of points.
        towers: number of towers; None if no model finds towers.
        tau: detection threshold.
        voxel_size_m: m.
        kernel_size: (kz, ky, kx) in voxels.
        tiles: number of tiles that hold a point.
        crs: CRS of the survey; None where the file names none.
        unit_sizes_m: sizes of the units of x, y and z, m; results are in these units.
        units: names of these units.
        warnings: what looks wrong about the survey, as sentences.
        files: of each file what ``SurveyFile.to_json`` gives.
        seconds: time of the prediction, files included, s.
        settings: settings of the prediction, with those of ``detection``.
        model_provenance: provenance of the model.
        outputs: path -> fingerprint of the classified points, the tower lists and the page. A
            later prediction replaces these files only if they are unchanged.
        targets: of each model, that of the attributes above first: its target, name, tau, voxel
            size (m), kernel size (voxels) and the number of points taken for the target.
        line: numbers of lines, spans, conductors, earth wires, cables and places to look at, what
            positions of wires are, and the counts of clearances; None if lines were not looked
            for.
    """

    survey: str
    model: str
    points: int
    towers: int | None
    tau: float
    voxel_size_m: float
    kernel_size: list[int]
    tiles: int
    crs: str | None
    unit_sizes_m: list[float]
    units: list[str]
    warnings: list[str]
    files: list[dict[str, Any]]
    seconds: float
    settings: dict[str, Any]
    model_provenance: dict[str, Any]
    outputs: dict[str, str]
    targets: list[dict[str, Any]] = field(default_factory=list)
    line: dict[str, Any] | None = None

    def to_json(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> PredictionSummary:
        """The summary that ``to_json`` gave.

        Raises:
            KeyError: a value is missing, other than ``targets`` and ``line``, which earlier
                versions did not write. Values that this version does not know are ignored.
        """
        known = {"targets": [], "line": None, **data}
        return cls(**{each.name: known[each.name] for each in fields(cls)})
