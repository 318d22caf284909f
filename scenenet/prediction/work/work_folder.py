"""The files between the stages of a prediction, and how a run goes on where another was stopped."""

from __future__ import annotations

import contextlib
import fcntl
import shutil
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenenet.core.errors import InputError, OutputError, storage_errors
from scenenet.core.files import digest, read_json, write_json
from scenenet.core.unchanged import FileState
from scenenet.pointcloud.targets import Target
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.work.block_file import BlockFile

RECORD, LOCK = "record.json", "lock"


@dataclass(frozen=True)
class WorkFolder:
    """A folder with a work file and a file of predictions for each file of a survey, the towers,
    and the record of the points that were written.

    Each file in it is whole, or is not there.
    """

    folder: Path

    def reads(self, survey: SurveyFiles) -> dict[Path, Path]:
        """The work file of each file of a survey that can be opened."""
        names = survey.names
        return {
            path: self._of(names[path], "work")
            for path in survey.files
            if path not in survey.refused
        }

    def predicted(self, name: str, target: Target) -> Path:
        """The predictions of the model of a target for a file, by its name in the survey."""
        return self._of(name, f"{target.name}.predictions")

    def all_predicted(self, name: str) -> list[Path]:
        """The predictions of all models for a file, by its name in the survey."""
        return list(self.folder.glob(self._of(name, "*.predictions").name))

    @property
    def towers(self) -> Path:
        """The towers (``FoundTowers``)."""
        return self.folder / "towers.json"

    @property
    def line(self) -> Path:
        """The lines, and the towers with those that they asked for (``FoundLine``)."""
        return self.folder / "line.json"

    @property
    def clearances(self) -> Path:
        """What is near the lines (``SurveyClearances``)."""
        return self.folder / "clearances.json"

    @property
    def written(self) -> Path:
        """Name of each file whose points were written -> what the status says about it."""
        return self.folder / "written.json"

    def bytes_kept(self) -> int:
        """Size of all files in it."""
        return sum(file.stat().st_size for file in self.folder.glob("*") if file.is_file())

    def _of(self, name: str, kind: str) -> Path:
        # Names of files may have folders, and differ in what a file system does not tell apart.
        return self.folder / f"{digest(name)}.{kind}"


@contextlib.contextmanager
def resumable(
    folder: Path, survey: SurveyFiles, made_by: Mapping[str, Any]
) -> Iterator[WorkFolder]:
    """The work folder of a survey, with what a run that was stopped had done.

    It is removed at the end of the block, and when the input is at fault. It stays when the run is
    stopped or the disk is full; the same call then goes on from there. What other settings or other
    files made is removed first, and stderr says so.

    Args:
        folder: hidden, beside the results.
        survey: its files.
        made_by: all that decides on the results besides the files: model, settings, code.

    Raises:
        OutputError: the folder cannot be made, is in use by another process, or is not a work
            folder.
    """
    with storage_errors(folder, str(folder.absolute())):
        _require_ours(folder)
        folder.mkdir(parents=True, exist_ok=True)
        with _locked(folder):
            work = WorkFolder(folder)
            _keep_what_fits(work, survey, made_by)
            try:
                yield work
            except BaseException as error:
                if not isinstance(error, InputError) or isinstance(error, OutputError):
                    print(
                        f"{survey.given}: stopped; what was done is kept in {folder}, and the same "
                        "command goes on from there",
                        file=sys.stderr,
                    )
                    raise
                shutil.rmtree(folder, ignore_errors=True)
                raise
            shutil.rmtree(folder, ignore_errors=True)


def _require_ours(folder: Path) -> None:
    """Refuse a folder of the same name that is not a work folder."""
    if not folder.exists():
        return
    names = {entry.name for entry in folder.iterdir()}
    if names - {LOCK} and RECORD not in names:
        raise OutputError(
            "a folder of this name exists, and is not the work folder of a prediction",
            file=folder,
            remedy="Choose another --out, or rename the folder",
        )


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold a lock in ``folder``. The system releases it when the process ends, however it ends."""
    with (folder / LOCK).open("wb") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OutputError(
                "another process is predicting this survey to the same place",
                file=folder,
                remedy="Wait until it has ended, or choose another --out",
            ) from None
        except OSError:
            pass  # a file system without locks
        yield


def _keep_what_fits(work: WorkFolder, survey: SurveyFiles, made_by: Mapping[str, Any]) -> None:
    """Remove what this run would make differently, and write what it is made by."""
    record = work.folder / RECORD
    reads = {survey.names[path]: out for path, out in work.reads(survey).items()}
    states = {survey.names[path]: _state(path) for path in work.reads(survey)}
    now = {"made_by": dict(made_by), "files": states}
    before = _read(record)
    if before is not None and before["made_by"] != now["made_by"]:
        print(
            f"{survey.given}: the work of an earlier run is discarded, because the model, the "
            "settings or the program have changed",
            file=sys.stderr,
        )
    elif before is not None:
        same = {name for name, state in states.items() if before["files"].get(name) == state}
        kept = {out for name, out in reads.items() if name in same and _is_whole(out)}
        if before["files"] == states:
            predicted = (out for name in states for out in work.all_predicted(name))
            kept |= {out for out in predicted if _is_whole(out)} | {
                work.towers,
                work.line,
                work.clearances,
                work.written,
            }
        else:
            print(
                f"{survey.given}: files have changed since the earlier run was stopped; "
                f"{len(kept)} of {len(states)} are not read again",
                file=sys.stderr,
            )
        _clear(work.folder, kept)
        write_json(record, now)
        return
    _clear(work.folder, set())
    write_json(record, now)


def _clear(folder: Path, kept: set[Path]) -> None:
    for entry in list(folder.iterdir()):
        if entry.name == LOCK or entry in kept:
            continue
        if entry.is_dir():  # what ``atomic`` leaves when its process is killed
            shutil.rmtree(entry, ignore_errors=True)
        else:
            entry.unlink()


def _state(path: Path) -> dict[str, Any] | None:
    try:
        return FileState.of(path).to_json()
    except InputError:
        return None


def _is_whole(file: Path) -> bool:
    try:
        BlockFile(file)
    except InputError:
        return False
    return True


def _read(record: Path) -> dict[str, Any] | None:
    """The record of an earlier run; None if there is none, or of an earlier version."""
    try:
        data = read_json(record)
        return {"made_by": dict(data["made_by"]), "files": dict(data["files"])}
    except (OSError, KeyError, TypeError, ValueError):
        return None
