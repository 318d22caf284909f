"""``docs/guides/observer.md`` from its first line to its last: a reader's files and commands.

It is the test, too, of a kernel file outside the package: trained, predicted, scored and
certified by the command line.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np
import pytest
from fixtures.forked import SCENENET, command_line

LIMIT_S = 600
LAMP = 19
PROGRAMS = {
    "scenenet": SCENENET,
    "python": "import runpy, sys; sys.argv.pop(0); runpy.run_path(sys.argv[0], {}, '__main__')",
    "pytest": "import sys, pytest; "
    "sys.exit(pytest.main(['-p', 'no:cacheprovider', *sys.argv[1:]]))",
}
"""What the page calls, as programs of a process that has their libraries already."""


@dataclass(frozen=True)
class Reader:
    """A folder in which the page was followed.

    Attributes:
        folder: with all files.
        shown: what each command wrote to stdout.
    """

    folder: Path
    shown: dict[str, str]

    def call(self, *arguments: str, program: str = "scenenet") -> subprocess.CompletedProcess[str]:
        """Call ``scenenet``, or another program of the page."""
        environment = {name: v for name, v in os.environ.items() if name != "SCENENET_KERNELS"}
        source = PROGRAMS[program]
        return command_line().call(source, arguments, self.folder, environment, LIMIT_S)

    def run(self, line: str) -> None:
        """Run a line of a shell example."""
        program, *arguments = shlex.split(line)
        done = self.call(*arguments, program=program)
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
        self.shown[line] = done.stdout

    def output(self, start: str) -> str:
        """What the last command that begins like this wrote."""
        return [text for line, text in self.shown.items() if line.startswith(start)][-1]


@pytest.fixture(scope="module")
def reader(tmp_path_factory, project_root: Path) -> Reader:
    page = (project_root / "docs" / "guides" / "observer.md").read_text(encoding="utf-8")
    reader = Reader(tmp_path_factory.mktemp("reader"), {})
    blocks = re.findall(r'```(sh|python title="([\w.]+)")\n(.*?)```', page, re.DOTALL)
    for kind, file, text in blocks:
        if kind == "sh":
            for line in text.splitlines():
                reader.run(line)
        else:
            (reader.folder / file).write_text(text, encoding="utf-8")
    return reader


def test_the_kernel_has_about_thirty_lines(reader):
    assert len((reader.folder / "lamp.py").read_text().splitlines()) <= 35


def test_the_kernel_answers_most_to_lamps_before_training(reader):
    shown = reader.output("scenenet geneo try")
    table = shown.partition("positive   highest\n")[2].splitlines()
    assert table[0].startswith("19 Overhead structure")
    places = shown.partition("highest responses")[2].splitlines()[1:5]
    assert all(place.endswith("19 Overhead structure") for place in places), shown
    assert (reader.folder / "lamp.html").read_text().count("data:image/png") == 5


def test_the_model_finds_the_lamps_of_another_street(reader):
    las = laspy.read(reader.folder / "found" / "other.laz")
    tau = json.loads((reader.folder / "lamps.json").read_text())["tau"]
    found = np.asarray(las["lamp_probability"]) >= np.float32(tau)
    lamp = np.asarray(las.classification) == LAMP
    assert (found & lamp).sum() > 0.9 * found.sum()
    x, z = np.asarray(las.x) - 530_000, np.asarray(las.z) - 100
    for middle in 25 * np.arange(3) + 12:  # of the three lamps
        own = lamp & (np.abs(x - middle) < 3)
        assert found[own & (z > 3) & (z < 9)].mean() > 0.9
    points = reader.output("scenenet evaluate").splitlines()[-1]
    assert points.startswith(f"points: {found.sum()} at or above tau, {lamp.sum()} labelled lamp")
    # The shares of the two kernels add up to the whole answer.
    shares = np.abs(las["lamp_lamp"]) + np.abs(las["lamp_surroundings"])
    np.testing.assert_allclose(shares[found], 1, atol=1e-5)


def test_the_model_file_names_the_kernel_with_its_digest(reader):
    from scenenet.core.files import sha256

    model = json.loads((reader.folder / "lamps.json").read_text())
    entry = model["geneos"][0]
    assert entry["source"] == {"file": "lamp.py", "sha256": sha256(reader.folder / "lamp.py")}
    assert "source" not in model["geneos"][1]


def test_the_certificate_holds(reader):
    shown = reader.output("scenenet geneo certify")
    assert "yes  zero-sum kernels sum to zero" in shown
    assert "yes  convex combination of GENEOs" in shown
    assert "yes  equivariant under translation" in shown


def test_the_model_is_refused_without_its_kernel_and_with_another(reader, tmp_path):
    without = reader.call("geneo", "certify", "--model", "lamps.json")
    assert without.returncode == 1
    assert without.stderr.startswith("error: lamps.json: it needs the kernel 'lamp' of the file")
    assert "--kernels" in without.stderr and "Traceback" not in without.stderr

    other = tmp_path / "lamp.py"
    other.write_text((reader.folder / "lamp.py").read_text() + "# another lamp\n")
    changed = reader.call("predict", "other.laz", "--model", "lamps.json",
                          "--kernels", str(other), "--out", "again")  # fmt: skip
    assert changed.returncode == 1
    assert "is another one" in changed.stderr and "Traceback" not in changed.stderr
    assert not (reader.folder / "again").exists()
