"""``scenenet`` in a process of its own, with what the trust suite does to it."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fixtures.forked import SCENENET, command_line

LIMIT_S = 900
"""A command that takes longer counts as stuck, even on a busy machine."""
POLL_S = 0.0005


def environment(**more: str) -> dict[str, str]:
    """The environment of a process of the suite: the package, the suite, and one thread."""
    tests = Path(__file__).resolve().parent.parent
    paths = os.pathsep.join([str(tests.parent), str(tests)])
    return os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": "1"} | more


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def fault(self) -> str | None:
        """What is wrong with how it ended; None after success, or one message and exit code 1."""
        if "Traceback" in self.err or self.code not in (0, 1):
            return f"it ended with exit code {self.code}: {self.err[-400:]}"
        if self.code == 1 and "error: " not in self.err:
            return f"it ended with exit code 1 without a message: {self.err[-400:]}"
        return None


STUCK = Ended(-1, "", f"it was stuck for {LIMIT_S} s")


def predict(survey: Path, model: Path, out: Path) -> tuple[object, ...]:
    """Arguments that predict a survey of poles without conductors."""
    return ("predict", survey, "--model", model, "--out", out, "--min-conductor", 0)


def start(*arguments: object, tmp: Path | None = None, max_file: int | None = None):
    """Start a command.

    Args:
        arguments: of ``scenenet``.
        tmp: directory for temporary files.
        max_file: limit on the size of a file that it may write, bytes.
    """
    program = SCENENET
    if max_file is not None:
        limit = f"import resource as r; r.setrlimit(r.RLIMIT_FSIZE, ({max_file},) * 2); "
        program = limit + SCENENET
    return subprocess.Popen(
        [sys.executable, "-c", program, *map(str, arguments)],
        env=_in(tmp),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _in(tmp: Path | None) -> dict[str, str]:
    """The environment of a process with its own directory for temporary files, which is made."""
    if tmp is None:
        return environment()
    tmp.mkdir(parents=True, exist_ok=True)
    return environment(TMPDIR=str(tmp))


def end_of(process: subprocess.Popen) -> Ended:
    """Wait for a command."""
    try:
        out, err = process.communicate(timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return STUCK
    return Ended(process.returncode, out, err)


def scenenet(*arguments: object, tmp: Path | None = None, max_file: int | None = None) -> Ended:
    """Run a command to its end."""
    if max_file is not None:  # a forked process writes its messages to files too
        return end_of(start(*arguments, tmp=tmp, max_file=max_file))
    done = command_line().call(SCENENET, [*map(str, arguments)], Path.cwd(), _in(tmp), LIMIT_S)
    if done.returncode == -signal.SIGALRM:
        return STUCK
    return Ended(done.returncode, done.stdout, done.stderr)


def must(*arguments: object, tmp: Path | None = None) -> Ended:
    """Run a command that nothing disturbs."""
    done = scenenet(*arguments, tmp=tmp)
    if done.code != 0:
        raise RuntimeError(f"scenenet {arguments[0]} failed without a disturbance: {done.err}")
    return done


def wait_for(event: Callable[[], bool], process: subprocess.Popen) -> bool:
    """Wait until ``event``; False if the process ends before."""
    stop = time.monotonic() + LIMIT_S
    while time.monotonic() < stop:
        if event():
            return True
        if process.poll() is not None:
            return False
        time.sleep(POLL_S)
    return False


def has(folder: Path, start_of_name: str) -> bool:
    """Whether a folder has an entry whose name begins so."""
    try:
        return any(entry.name.startswith(start_of_name) for entry in os.scandir(folder))
    except FileNotFoundError:
        return False


def files_in(folder: Path) -> dict[str, bytes]:
    """Content of every file below a folder, hidden ones too."""
    if not folder.exists():
        return {}
    found = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


@contextmanager
def small_disk(folder: Path, size: int) -> Iterator[Path | None]:
    """A disk of ``size`` bytes at ``folder``; None where mounting is not permitted."""
    folder.mkdir(parents=True)
    options = f"size={size},mode=755"
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", options, "trust", str(folder)], capture_output=True
    )
    if mounted.returncode != 0:
        yield None
        return
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def fill_disk(folder: Path, leave: int = 0) -> None:
    """Fill the disk of ``folder`` but for ``leave`` bytes."""
    page = resource.getpagesize()
    with Path(folder, "filled").open("wb", buffering=0) as stream:
        try:
            while os.statvfs(folder).f_bavail * os.statvfs(folder).f_frsize >= leave + page:
                stream.write(bytes(page))
        except OSError:  # full
            return
