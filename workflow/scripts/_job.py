"""What every script of the workflow does before and after its one call of the package.

A script defines a function that takes a job, and passes it to ``run``. It imports the package
inside that function, so that every error, even a missing library, is in the log.
"""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

# Last, so that an installed package comes first: an environment that Snakemake made has none.
sys.path.append(str(Path(__file__).resolve().parents[2]))

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "RAYON_NUM_THREADS",
)


NOT_RECORDED = (
    *("store", "stores", "crop_stores", "towers_record"),
    *("works", "predictions", "observed", "wires", "points"),
)
"""Inputs without a fingerprint in the record: a manifest has the digest of its store, and the
record of the labelled towers describes a table that is an input with a fingerprint. The work files
of a survey of tiles follow from the tiles, whose fingerprints are among the parameters."""


RECIPE, UNREADABLE = "recipe:", "unreadable"
"""How the parameter of a job begins that stands for a synthetic survey, and for one that could not
be read when the run was planned (``source_print`` in the rules)."""


@dataclass(frozen=True)
class Job:
    """A job as Snakemake describes it, without the configuration: a script that read it would
    depend on settings that are not among its parameters.

    Attributes:
        identity: the parameter ``job`` of the rule: stage, settings, code, and all else that the
            result depends on.
        input, output: files by name; attribute access works as in Snakemake.
        threads: number of threads that it may use.
    """

    identity: Mapping[str, Any]
    input: Any
    output: Any
    threads: int

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the stage, to build its model from."""
        return dict(self.identity["settings"])

    def made_by(self) -> dict[str, Any]:
        """Settings, code and version, for a file that has its own record."""
        from scenenet.core.files import digest
        from scenenet.core.provenance import package_version

        return {
            "config": digest(self.identity["settings"]),
            "code": self.identity["code"],
            "version": package_version(),
        }

    def record(self) -> dict[str, Any]:
        """Inputs, settings and code of the result."""
        from scenenet.core import provenance

        made_by = self.made_by()
        return provenance.record(
            self.identity["stage"],
            self.identity["settings"],
            dict(self._input_prints()),
            made_by["code"],
            made_by["config"],
            self.identity.get("seed"),
        )

    def _input_prints(self) -> Iterator[tuple[str, Any]]:
        known = self.identity.get("input", {})
        for name, files in self.input.items():
            if name in known:
                yield name, known[name]
            elif name not in NOT_RECORDED:
                single = isinstance(files, str)
                yield name, _print(files) if single else [_print(file) for file in files]


def run(stage: Callable[[Job], object]) -> None:
    """Call ``stage`` with the job that Snakemake started this process for, and write the record.

    Standard output and error go to the log of the rule from the start, also those of child
    processes and of compiled code. Progress, which the package writes to ``sys.stderr``, is shown
    on the terminal as well.
    """
    import __main__
    from scenenet.core.interrupts import end_cleanly_on_signals

    end_cleanly_on_signals()
    snakemake = __main__.snakemake
    log = _redirect(snakemake.log[0])
    sys.excepthook = lambda kind, error, trace: _explain(log, kind, error, trace)
    # Libraries read these when they are imported, so they come before any import of the package.
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, str(snakemake.threads)))
    job = Job(snakemake.params.job, snakemake.input, snakemake.output, snakemake.threads)
    with _one_survey(job):
        stage(job)
    record = getattr(job.output, "provenance", None)
    if record is not None:
        from scenenet.core.files import write_json

        write_json(record, job.record())


@contextlib.contextmanager
def _one_survey(job: Job) -> Iterator[None]:
    """Make sure that a job uses, to its end, the survey that was there when the run was planned and
    that its labelled towers were found in."""
    survey = getattr(job.input, "survey", None)
    if survey is None:
        yield
        return
    from scenenet.core.unchanged import unchanged

    with unchanged(survey):
        _require_planned(job, survey)
        yield


def _require_planned(job: Job, survey: str) -> None:
    from scenenet.core.errors import InputError
    from scenenet.core.files import read_json
    from scenenet.core.provenance import is_still

    planned = job.identity.get("input", {}).get("survey", UNREADABLE)
    towers = getattr(job.input, "towers_record", None)
    same = towers is None or read_json(towers)["inputs"]["survey"] == planned
    # A synthetic survey is known by its recipe. An unreadable one fails in its own stage.
    if not planned.startswith((RECIPE, UNREADABLE)):
        same = same and is_still(survey, planned)
    if not same:
        raise InputError(
            "the survey was replaced while the workflow ran, or after its labelled towers were "
            "found",
            file=survey,
            remedy="Run the workflow again when no program writes to the survey",
        )


class _Both:
    """A text stream that writes to the log and to the terminal."""

    def __init__(self, *streams: TextIO) -> None:
        self._streams = streams

    def write(self, text: str) -> int:
        for stream in self._streams:
            stream.write(text)
        return len(text)

    def flush(self) -> None:
        for stream in self._streams:
            stream.flush()

    def isatty(self) -> bool:
        """False, so that progress is written as lines: several jobs share the terminal."""
        return False


def _redirect(path: str) -> TextIO:
    terminal = os.fdopen(os.dup(2), "w", buffering=1, encoding="utf-8")
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o644)
    os.dup2(descriptor, 1)
    os.dup2(descriptor, 2)
    os.close(descriptor)
    log = os.fdopen(1, "w", buffering=1, encoding="utf-8", closefd=False)
    sys.stdout = log
    sys.stderr = _Both(log, terminal)
    logging.basicConfig(stream=log, level=logging.INFO, format="%(name)s: %(message)s")
    logging.captureWarnings(True)
    return log


def _explain(log: TextIO, kind: type[BaseException], error: BaseException, trace: Any) -> None:
    """Write the message of an input error, or the traceback of a fault in the code, to the log."""
    if kind.__name__ == "InputError":
        print(f"Error: {error}", file=log)
    else:
        traceback.print_exception(kind, error, trace, file=log)
    log.flush()


def _print(path: str) -> str:
    """Fingerprint of an input. That of a manifest is the digest of the data it describes, because
    the file also has the seconds that the job took."""
    from scenenet.core.files import read_json
    from scenenet.core.provenance import fingerprint

    if Path(path).name == "manifest.json":
        return f"content:{read_json(path)['content']}"
    return fingerprint(path)
