"""Class codes that do not fit the class scheme."""

from __future__ import annotations

import numpy as np

from scenenet.pointcloud.class_schemes import ClassScheme, misfit
from scenenet.pointcloud.targets import TOWER, Target

FLAG_BITS = 0x1F
MANY_CODES = 8
"""Undefined codes that a warning lists one by one."""

CODE_KINDS = ("undefined", "scheme", "no tower", "merged")
"""Kinds of what ``code_findings`` finds."""


def in_words(n: int) -> str:
    """A number of points, in words."""
    return "1 point" if n == 1 else f"{n} points"


def code_findings(
    counts: np.ndarray, scheme: ClassScheme, form: str, target: Target = TOWER
) -> list[tuple[str, str]]:
    """(kind, text) of what is odd about the codes of a survey.

    Args:
        counts: (256,) points of each code.
        scheme: what the user says that the codes mean.
        form: format of the file.
        target: what the labels are used for. Only for towers a survey without any is odd here; what
            cuts crops for another target reports a file without it.
    """
    findings = []
    found = np.flatnonzero(counts).tolist()
    unknown = [code for code in found if code not in scheme.classes]
    if unknown:
        listed = ", ".join(f"{code} ({in_words(counts[code])})" for code in unknown[:MANY_CODES])
        if len(unknown) > MANY_CODES:
            listed += f" and {len(unknown) - MANY_CODES} more"
        hint = ""
        if all(code & 0x80 and code & FLAG_BITS in scheme.classes for code in unknown):
            real = ", ".join(str(code & FLAG_BITS) for code in unknown)
            hint = f"; they look like {real} with flags in the upper bits"
        text = f"class scheme {scheme.name} does not define these codes: {listed}{hint}"
        findings.append(("undefined", text))
    if wrong := misfit(scheme, counts):
        findings.append(("scheme", wrong))
    if target.is_tower and not any(counts[code] for code in scheme.tower):
        tower = ", ".join(map(str, sorted(scheme.tower)))
        text = (
            f"no point is labelled tower (code {tower} in {scheme.name}): the survey can be "
            "predicted, but not used for training"
        )
        findings.append(("no tower", text))
    if form == "pt" and scheme.name != "ts40k" and max(found, default=0) <= 5:
        text = (
            f"all class codes are 5 or below. The .pt samples of TS40K have six merged classes "
            f"(tower 4): use class scheme ts40k, not {scheme.name}"
        )
        findings.append(("merged", text))
    return findings
