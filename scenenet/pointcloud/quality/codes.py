"""Class codes that do not fit the class scheme."""

from __future__ import annotations

import numpy as np

from scenenet.pointcloud.class_schemes import ClassScheme, Role, misfit
from scenenet.pointcloud.targets import TOWER, Target

FLAG_BITS = 0x1F
MANY_CODES = 8
"""Undefined codes that a warning lists one by one."""

FEW_CONDUCTORS = 0.01
"""Points of conductors for each point of towers below which conductors are not labelled: they leave
every tower, and are not much fewer than its points."""

CODE_KINDS = ("undefined", "scheme", "no tower", "no conductor", "merged")
"""Kinds of what ``code_findings`` finds."""


def in_words(n: int) -> str:
    """A number of points, in words."""
    return "1 point" if n == 1 else f"{n} points"


def codes_found(counts: np.ndarray) -> str:
    """The codes of a file with their points (256,), in words, those with most points first."""
    order = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)].tolist()
    more = f" and {len(order) - MANY_CODES} more" if len(order) > MANY_CODES else ""
    return ", ".join(f"{code} ({in_words(counts[code])})" for code in order[:MANY_CODES]) + more


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
    towers, wires = (
        int(counts[list(scheme.with_role(role))].sum()) for role in ("tower", "conductor")
    )
    if target.is_tower and not towers:
        text = (
            f"no point is labelled tower (code {_listed(scheme, 'tower')}): the survey can be "
            f"predicted, but not used for training. It has the codes {codes_found(counts)}"
        )
        findings.append(("no tower", text))
    elif not wrong and wires < FEW_CONDUCTORS * towers:
        text = (
            f"{in_words(towers)} are labelled tower, and {wires} conductor (code "
            f"{_listed(scheme, 'conductor')}). If conductors are labelled, another scheme is "
            f"needed: name it with --codes. The survey has the codes {codes_found(counts)}"
        )
        findings.append(("no conductor", text))
    if form == "pt" and scheme.name != "ts40k" and max(found, default=0) <= 5:
        text = (
            f"all class codes are 5 or below. The .pt samples of TS40K have six merged classes "
            f"(tower 4): use class scheme ts40k, not {scheme.name}"
        )
        findings.append(("merged", text))
    return findings


def _listed(scheme: ClassScheme, role: Role) -> str:
    return f"{' or '.join(map(str, sorted(scheme.with_role(role))))} in {scheme.name}"
