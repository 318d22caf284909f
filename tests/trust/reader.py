"""The process that reads damaged files: ``python -m trust.reader KIND FOLDER SEED``.

It reads a number and a flag a line, and answers with a line of JSON: ``what`` was done to the file,
and ``lost`` if reading it ended in anything but an answer or an InputError.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import resource
import shutil
import sys
import traceback
from collections.abc import Callable
from pathlib import Path

from trust.damage import damaged
from trust.mutations import MAX_MEMORY
from trust.originals import MODELS, SUFFIX, originals, write_pole_model, write_survey

from scenenet.core.errors import InputError

ADDRESS_SPACE = 12 * 2**30
"""A safety net for the machine; the limit of the suite is ``MAX_MEMORY``."""


def main() -> None:
    kind, folder, seed = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # output of libraries must not mix with the answers
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE,) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    contents = originals(kind)
    path = folder / f"case{SUFFIX[kind]}"
    out = folder / "out"
    commands: list[list[object]] = []
    read = _read_model if kind in MODELS else _read_survey
    read_intact(read, path, contents)
    print("ready", file=answers)
    for line in sys.stdin:
        number, through_commands = (int(part) for part in line.split())
        data, what = damaged(kind, contents, seed, number)
        path.write_bytes(data)
        lost = _within_memory(lambda: read(path))
        if lost is None and through_commands:
            commands = commands or _commands(kind, path, folder, out)
            for command in commands:
                lost = lost or _within_memory(lambda command=command: _called(command))
            shutil.rmtree(out, ignore_errors=True)
        answer = {"what": what} if lost is None else {"what": what, "lost": lost}
        print(json.dumps(answer), file=answers)


def _commands(kind: str, path: Path, folder: Path, out: Path) -> list[list[object]]:
    """The command lines that read the file, with the other files that they need."""
    survey, model = folder / "survey.laz", folder / "model.json"
    write_survey(survey)
    write_pole_model(model)
    if kind in MODELS:
        return [["predict", survey, "--model", path, "--out", out]]
    return [["check", path], ["predict", path, "--model", model, "--out", out]]


def read_intact(read: Callable[[Path], str | None], path: Path, contents: list[bytes]) -> None:
    """Make sure that the intact files give an answer: else the suite would try nothing."""
    for content in contents:
        path.write_bytes(content)
        try:
            lost = read(path)
        except InputError as error:
            lost = str(error)
        if lost is not None:
            raise SystemExit(f"an intact file is refused: {lost}")


def _read_survey(path: Path) -> str | None:
    from scenenet.pointcloud import iter_chunks, survey_info

    info = survey_info(path)
    n = sum(len(chunk) for chunk in iter_chunks(path))
    return None if n == info.n_points else f"{n} points of {info.n_points} were read"


def _read_model(path: Path) -> str | None:
    from scenenet.models.model_file import read_model

    read_model(path)
    return None


def _within_memory(act: Callable[[], str | None]) -> str | None:
    """What was lost by the action: None if it ended in an answer or an InputError."""
    Path("/proc/self/clear_refs").write_text("5")  # forget the highest use of memory so far
    try:
        lost = act()
    except InputError as error:
        lost = None if error.problem.strip() else "an error without a message"
    except BaseException as error:  # a panic of a decoder is not an Exception
        lost = f"{type(error).__name__}: {str(error)[:300]} ({_place()})"
    used = max(_peak(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)
    if lost is None and used > MAX_MEMORY:
        lost = f"{used / 2**20:.0f} MiB of memory were used, more than {MAX_MEMORY / 2**20:.0f}"
    return lost


def _place() -> str:
    frames = traceback.extract_tb(sys.exc_info()[2])
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}"


def _peak() -> int:
    """Highest resident memory of this process, bytes."""
    found = re.search(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text())
    return int(found[1]) * 1024 if found else 0


def _called(command: list[object]) -> str | None:
    """Call the command line: it answers, or names the fault with exit code 1."""
    from scenenet.cli.app import main as scenenet

    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            scenenet([str(part) for part in command])
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
    said = err.getvalue()
    if "Traceback" in said or code not in (0, 1) or (code == 1 and "error: " not in said):
        return f"{command[0]} ended with exit code {code}: {said[-300:]}"
    return None


if __name__ == "__main__":
    main()
