"""The runs of the workflow that README and docs quote can be repeated with their commands."""

from __future__ import annotations

import shlex
from pathlib import Path

import kept_runs
import pytest
from fixtures.project import PARTS, copy_parts

ROOT = Path(__file__).resolve().parents[2]
WORKFLOW = {
    name: run.command
    for name, run in kept_runs.read_figures(ROOT).runs.items()
    if run.command.startswith("snakemake ") and "FOLDER" not in run.command
}
"""The command of each run that needs no recordings."""


@pytest.mark.parametrize("name", sorted(WORKFLOW))
def test_the_command_of_a_run_that_pages_quote_plans_its_files(name, project_in, tmp_path):
    copy_parts(ROOT, tmp_path, [*PARTS, kept_runs.KEPT])
    assert project_in(tmp_path).planned(*shlex.split(WORKFLOW[name])[1:])
