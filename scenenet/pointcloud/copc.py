"""Convert a LAZ file to COPC with PDAL, which this package does not require."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError
from scenenet.core.files import atomic
from scenenet.pointcloud.reading import survey_info

PROGRAM, WRITER = "pdal", "writers.copc"
SUFFIX = ".copc.laz"
LEAVE_OUT = "Install PDAL 2.4 or later (https://pdal.io), or leave --copc out"


def require_pdal() -> str:
    """The path of PDAL, checked before any work that would be lost without it.

    Raises:
        InputError: it is not on PATH, cannot be started, or cannot write COPC.
    """
    program = shutil.which(PROGRAM)
    if program is None:
        raise InputError(
            f"--copc needs the program {PROGRAM}, which is not on PATH", remedy=LEAVE_OUT
        )
    drivers = _run([program, "--drivers"])
    if drivers.returncode or WRITER not in drivers.stdout:
        raise InputError(f"this {PROGRAM} has no {WRITER}", file=program, remedy=LEAVE_OUT)
    return program


def pipeline(source: Path, target: Path) -> list[dict[str, Any]]:
    """The pipeline of PDAL that writes a LAZ file as COPC with everything that it has.

    Without its options PDAL rounds coordinates to 0.01 and drops extra dimensions and records.
    """
    return [
        {"type": "readers.las", "filename": str(source), "use_eb_vlr": True},
        {"type": WRITER, "filename": str(target), "forward": "all", "extra_dims": "all"},
    ]


def write_copc(source: Path, target: Path) -> None:
    """Write a LAZ file as COPC, whole or not at all. COPC orders the points by place.

    Args:
        source: LAZ file.
        target: ends in ``.copc.laz``.

    Raises:
        InputError: PDAL is missing or failed, or its file lacks something.
        OutputError: the folder cannot be written to.
    """
    program = require_pdal()
    with atomic(target) as partial:
        text = json.dumps(pipeline(source.absolute(), partial.absolute()))
        done = _run([program, "pipeline", "--stdin"], text)
        if done.returncode:
            said = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()[-1]
            raise InputError(
                f"{PROGRAM} could not convert it to COPC (code {done.returncode}): {said}",
                file=source,
                remedy="Leave --copc out",
            )
        check_copc(source, partial)


def check_copc(source: Path, copc: Path) -> None:
    """Check from its header that a COPC file has the points and dimensions of its source.

    Raises:
        InputError: it is not COPC, or lacks something.
    """
    before, after = survey_info(source), survey_info(copc)
    kept = {_as_pdal(name) for name in after.extra_dimensions}
    lost = [
        name
        for name in before.extra_dimensions
        if not {_as_pdal(name), f"{_as_pdal(name)}0"} & kept  # PDAL numbers the parts of an array
    ]
    faults = [
        after.format != "copc" and f"{PROGRAM} wrote {after.format.upper()} and not COPC",
        after.n_points != before.n_points
        and f"it has {after.n_points} points in place of {before.n_points}",
        after.scales != before.scales
        and f"its steps are {after.scales} in place of {before.scales}",
        bool(lost) and f"it lacks the dimensions {', '.join(lost)}",
        after.crs is None and before.crs is not None and "it lacks the coordinate system",
    ]
    if wrong := [fault for fault in faults if fault]:
        raise InputError(
            f"the file in COPC that {PROGRAM} wrote differs: {'; '.join(map(str, wrong))}",
            file=source,
            remedy=f"Leave --copc out, or use a newer {PROGRAM}",
        )


def _as_pdal(name: str) -> str:
    """A name without what PDAL changes in it: letters that it does not allow, and their size."""
    return re.sub("[^a-z0-9]", "_", name.casefold())


def _run(command: list[str], text: str = "") -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    except OSError as error:
        raise InputError(
            f"the program cannot be started ({error.strerror})", file=command[0], remedy=LEAVE_OUT
        ) from None
