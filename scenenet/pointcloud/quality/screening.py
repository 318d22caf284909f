"""What looks wrong about a survey, found in a pass over its points that a command makes anyway.

``scenenet check`` says all of this and more; ``predict``, ``explain``, ``train`` and ``evaluate``
say it of every file that they use. It costs little: most of it looks at a sample of each chunk.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scenenet.pointcloud.class_schemes import ClassScheme, class_scheme
from scenenet.pointcloud.quality.codes import CODE_KINDS, code_findings
from scenenet.pointcloud.quality.density import Density
from scenenet.pointcloud.quality.map_scale import map_findings
from scenenet.pointcloud.quality.relief import Relief
from scenenet.pointcloud.quality.steps import CoordinateSteps
from scenenet.pointcloud.reading import SurveyInfo, iter_chunks, survey_info
from scenenet.pointcloud.targets import TOWER, Target
from scenenet.pointcloud.ts40k import sample_files
from scenenet.pointcloud.units import CONVERT, NotMetres, not_metres

SAMPLE_POINTS = 50_000
"""Points of a chunk that are looked at closely."""
STRAY_FACTOR = 10.0
"""Points are stray if they are outside the middle 98 % by this many times its extent."""
MIN_POINTS = 100
"""Fewer points do not show what the extent of a survey is."""
CONVERTED = "it is converted, and the results are in the units of the survey"
CONVERTS = (
    "scenenet predict and explain convert it, and give results in this unit. Others need metres"
)
NO_SYSTEM = "the file names no coordinate system; its coordinates are taken to be in metres"

GIVEN_SYSTEM = "the file names no coordinate system; it is taken to be in {}, as given"


class Finding(NamedTuple):
    """Something that looks wrong.

    Attributes:
        kind: short name; two samples of a folder with findings of one kind are reported together.
        text: what and why, as a sentence without a full stop.
    """

    kind: str
    text: str


class Screening:
    """What looks wrong about a survey, from its header and its points."""

    def __init__(
        self,
        info: SurveyInfo,
        scheme: ClassScheme | None = None,
        *,
        converted: bool = False,
        target: Target = TOWER,
    ) -> None:
        """No point is counted yet.

        Args:
            info: the header of the survey.
            scheme: what its class codes mean; None if they are not used.
            converted: whether the command converts other units of length.
            target: what the class codes are used for.
        """
        self.info, self._target = info, target
        self._converted = converted
        self._sizes = np.array(info.unit_sizes if converted else (1.0, 1.0, 1.0))
        self.scheme = scheme
        self.n_points = 0
        self.counts = np.zeros(256, np.int64)
        self.mins, self.maxs = np.full(3, np.inf), np.full(3, -np.inf)
        self._steps = CoordinateSteps(info.scales)
        self._relief, self._density = Relief(), Density()
        self._samples: list[np.ndarray] = []

    def add(self, xyz: np.ndarray, codes: np.ndarray) -> None:
        """Look at points (n, 3), in the units of the survey, with class codes (n,)."""
        if len(xyz) == 0:
            return
        self.n_points += len(xyz)
        # Column by column: several times as fast as along the first axis.
        self.mins = np.minimum(self.mins, [column.min() for column in xyz.T])
        self.maxs = np.maximum(self.maxs, [column.max() for column in xyz.T])
        if self.scheme is not None:
            self.counts += np.bincount(codes, minlength=256)
        sample = xyz[:: max(1, len(xyz) // SAMPLE_POINTS)]
        self._steps.add(sample)
        self._relief.add(sample * self._sizes)
        self._density.add(sample * self._sizes)
        self._samples.append(sample[:: max(1, len(sample) // 1000)])

    @property
    def not_metres(self) -> NotMetres | None:
        """Why the coordinates are known not to be metres, from the points themselves."""
        if not self.n_points:
            return None
        reason = not_metres(
            self.info.record, self.mins.tolist(), self.maxs.tolist(), self.info.scales
        )
        return None if self._converted and reason and reason.is_length else reason

    def raise_if_not_metres(self) -> None:
        """Refuse a survey whose header hides that it is in degrees.

        Raises:
            InputError: the coordinates are known not to be metres.
        """
        if reason := self.not_metres:
            raise reason.error(self.info.path)

    def findings(self) -> list[Finding]:
        """Everything that looks wrong, the most important first."""
        found = [Finding(text, text) for text in self.info.warnings]
        if not self.n_points:
            return [*found, Finding("empty", "the survey has no points")]
        if self.info.record.given and self.info.crs is not None:
            found.append(Finding("given system", GIVEN_SYSTEM.format(self.info.crs.name)))
        if reason := self.not_metres:
            place = f"{reason.place}: " if reason.place else ""
            remedy = f"{CONVERTS} {CONVERT}" if reason.is_length else reason.remedy
            return [*found, Finding("unit", f"{place}{reason.problem}. {remedy}")]
        if self._converted and (reason := self.info.not_metres):
            found.append(Finding("converted", f"{reason.problem}; {CONVERTED}"))
        if self.info.crs is None and not self.info.record.problems:
            found.append(Finding("no system", NO_SYSTEM))
        if self.info.crs is not None:
            middle = np.median(np.concatenate(self._samples), axis=0)  # stray points do not count
            found += [Finding(*each) for each in map_findings(self.info.crs, middle[:2])]
        found += [Finding(*each) for each in self._steps.findings()]
        relief = [Finding(*each) for each in self._relief.findings(self.n_points)]
        # Coordinates that are not in metres have no density.
        found += relief or [Finding(*each) for each in self._thin()]
        if self.scheme is not None:
            codes = self.counts, self.scheme, self.info.format, self._target
            found += [Finding(*each) for each in code_findings(*codes)]
        return found

    def _thin(self) -> list[tuple[str, str]]:
        """A density that hides towers, where towers are looked for."""
        return self._density.findings(self.n_points) if self._target.is_tower else []

    def stray(self) -> list[Finding]:
        """Whether the extent of the survey is that of a few points far from the others."""
        if self.n_points < MIN_POINTS:
            return []
        low, high = np.percentile(np.concatenate(self._samples), [1, 99], axis=0)
        reach = STRAY_FACTOR * np.maximum(high - low, 1)
        axes = [
            f"{name} {bottom:.7g} to {top:.7g}"
            for name, bottom, top, least, most in zip(
                "xyz", self.mins, self.maxs, low - reach, high + reach, strict=True
            )
            if bottom < least or top > most
        ]
        if not axes:
            return []
        return [
            Finding(
                "stray",
                f"stray coordinates: some points are far from all others ({', '.join(axes)})",
            )
        ]

    def warnings(self) -> tuple[str, ...]:
        """What a command that acts on the survey says about it."""
        return tuple(finding.text for finding in [*self.findings(), *self.stray()])


def survey_warnings(
    path: str | Path, codes: str | None = None, target: Target = TOWER
) -> tuple[str, ...]:
    """What looks wrong about a survey, a TS40K sample or a folder of them, in a pass of its own.

    Args:
        path: LAS, LAZ, COPC, .npy or .pt file, or a folder of samples.
        codes: class scheme; None if the class codes are not used.
        target: what the class codes are used for.

    Raises:
        InputError: the survey cannot be read.
    """
    path = Path(path)
    scheme = None if codes is None else class_scheme(codes)
    if not path.is_dir():
        return _screened(path, scheme, target).warnings()
    samples = {sample.name: _screened(sample, scheme, target) for sample in sample_files(path)}
    counts = sum((one.counts for one in samples.values()), np.zeros(256, np.int64))
    each = {name: [*one.findings(), *one.stray()] for name, one in samples.items()}
    return tuple(of_samples(each, counts, scheme, target))


def of_samples(
    each: Mapping[str, Sequence[Finding]],
    counts: np.ndarray,
    scheme: ClassScheme | None,
    target: Target = TOWER,
) -> list[str]:
    """The findings of the samples of a folder: one sentence for each kind.

    Args:
        each: name of a sample -> its findings.
        counts: (256,) points of each code in all samples together: one sample alone says little
            about the codes.
        scheme: what the codes mean; None if they are not used.
        target: what they are used for.
    """
    texts = []
    kinds = dict.fromkeys(f.kind for findings in each.values() for f in findings)
    for kind in [kind for kind in kinds if kind not in CODE_KINDS]:
        found = {
            name: f.text for name, findings in each.items() for f in findings if f.kind == kind
        }
        name, text = next(iter(found.items()))
        more = f" and {len(found) - 1} more of {len(each)} samples" if len(found) > 1 else ""
        texts.append(f"{text} ({name}{more})" if len(each) > 1 else text)
    if scheme is not None:
        form = Path(next(iter(each))).suffix.removeprefix(".")
        texts += [text for _, text in code_findings(counts, scheme, form, target)]
    return texts


def _screened(path: Path, scheme: ClassScheme | None, target: Target) -> Screening:
    screening = Screening(survey_info(path), scheme, target=target)
    for chunk in iter_chunks(path):
        screening.add(chunk.xyz, chunk.classification)
    return screening
