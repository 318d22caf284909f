"""Mistakes in the sheet or in the configuration are reported before any job starts."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.workflow

LONGEST = 14
"""Largest number of lines of an error, the name of the Snakefile and an empty line included."""


def short(message: str) -> str:
    """The message without the lines that Snakemake writes on every call."""
    assert "Traceback" not in message
    lines = message.splitlines()
    start = next(i for i, line in enumerate(lines) if "WorkflowError" in line)
    assert len(lines) - start <= LONGEST
    return "\n".join(lines[start:])


def test_a_typo_in_the_configuration(project):
    project.configure({"voxels.resolutoin": 64})
    message = short(project.refused())
    assert "voxels.resolutoin: there is no such setting. Did you mean 'resolution'?" in message
    assert "        resolution: 64" in message


def test_a_typo_on_the_command_line(project):
    message = short(project.refused("--config", "ts40kdir=data"))
    assert "ts40kdir: there is no such setting. Did you mean 'ts40k_dir'?" in message


def test_all_problems_of_the_sheet(project):
    project.add_row("own", "data/own.laz", "edpp", "new")
    project.add_row("other", "data/onw.laz", "edp", "new")
    message = short(project.refused())
    assert "config/surveys.tsv: 4 problems in the survey sheet" in message
    assert "line 5: codes 'edpp' is not one of" in message
    assert "line 5: the name 'own' is on line 4 already" in message
    assert "line 6: data/onw.laz is not there, did you mean data/own.laz?" in message


def test_a_kernel_file_that_is_missing(project):
    project.configure({"kernels": ["data/lamp.py"]})
    message = short(project.refused())
    assert "data/lamp.py: kernels: there is no such kernel file" in message


def test_nothing_to_learn_from(project):
    sheet = project.folder / "config/surveys.tsv"
    sheet.write_text("".join(sheet.read_text().splitlines(keepends=True)[i] for i in (0, 3)))
    message = short(project.refused())
    assert "no survey has the role train" in message
    assert "scenenet predict SURVEY --model" in message


def test_a_folder_without_samples(project):
    message = short(project.refused("--config", "ts40k_dir=data"))
    assert "data: there are no TS40K samples" in message
