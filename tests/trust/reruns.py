"""Changes after which Snakemake alone runs too little or too much (docs/development/reruns.md).

The tests of the workflow make these changes; this runs them and counts.
"""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from pathlib import Path

from trust.processes import environment
from trust.table import Attempt, Subject

ROOT = Path(__file__).resolve().parents[2]
CHANGES = {
    "a survey is added": "test_reruns.py::"
    "test_a_new_survey_in_the_sheet_runs_its_own_jobs_and_the_report",
    "a setting changes": "test_reruns.py::"
    "test_another_emphasis_of_the_loss_trains_again_and_prepares_nothing",
    "a script would read the configuration": "test_rules.py::"
    "test_scripts_know_nothing_of_the_configuration",
    "a module that a script imports changes": "test_reruns.py::"
    "test_editing_the_training_loop_trains_again_and_prepares_nothing",
    "a survey is replaced by an older file": "test_reruns.py::"
    "test_replacing_a_survey_by_an_older_file_runs_its_jobs",
    "two settings swap their values": "test_reruns.py::"
    "test_swapping_the_values_of_two_settings_trains_again",
    "a parameter is not a plain dict": "test_rules.py::"
    "test_every_input_and_output_has_a_name_and_the_parameter_is_one_dict",
    "the survey sheet is sorted anew": "test_reruns.py::"
    "test_the_order_and_the_date_of_the_sheet_have_no_effect",
    "a part of a store is lost": "test_run.py::test_a_store_that_was_damaged_is_refused",
    "one of many files of a survey is deleted": "test_reruns.py::"
    "test_a_deleted_cache_of_voxels_is_made_again",
    "a script is touched": "test_reruns.py::test_touching_every_script_and_module_runs_nothing",
}
"""Change -> the test of the workflow that makes it."""


def _try(folder: Path, seed: int, numbers: Sequence[int]) -> Iterator[Attempt]:
    chosen = {number: list(CHANGES.items())[number] for number in numbers}
    report = folder / "report.xml"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--junitxml={report}",
         f"--basetemp={folder / 'tests'}",
         *(f"tests/workflow/{test}" for _, test in chosen.values())],
        cwd=ROOT, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        check=False,
    )  # fmt: skip
    if not report.exists():
        raise RuntimeError(f"the tests did not run: {done.stdout[-1000:]}")
    cases = {case.get("name"): case for case in ET.parse(report).iter("testcase")}
    for number, (what, test) in chosen.items():
        case = cases.get(test.partition("::")[2])
        yield Attempt(number, what, _fault(case, done.stdout))


def _fault(case: ET.Element | None, shown: str) -> str | None:
    if case is None:
        return f"its test is missing: {shown[-300:]}"
    faults = [child for child in case if child.tag in ("failure", "error", "skipped")]
    return f"{faults[0].tag}: {(faults[0].get('message') or '')[:300]}" if faults else None


SUBJECTS = [Subject("reruns after a change", _try, len(CHANGES))]
