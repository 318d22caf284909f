"""Rules read like a form that is always filled in the same way, and profiles agree."""

from __future__ import annotations

import re

import pytest
import yaml

FORM = [
    *("input", "output", "log", "benchmark"),
    *("threads", "resources", "params", "message", "script"),
]
OPTIONAL = {"input"}  # nothing goes into the first rules


def rules(root) -> dict[str, list[str]]:
    """Name of each rule that is written out -> its directives, in order."""
    text = "\n".join(p.read_text() for p in sorted((root / "workflow" / "rules").glob("*.smk")))
    found = re.findall(r"^rule (\w+):\n((?:    .*\n|\n)+)", text, re.MULTILINE)
    return {name: re.findall(r"^    (\w+):", body, re.MULTILINE) for name, body in found}


def test_every_rule_fills_in_the_form_in_order(project_root):
    found = rules(project_root)
    assert len(found) > 15
    for name, directives in found.items():
        filled = [directive for directive in directives if directive in FORM]
        assert filled == [d for d in FORM if d in filled], name
        assert set(FORM) - set(filled) <= OPTIONAL, name


def test_every_stage_has_a_script_and_every_script_a_rule(project_root):
    scripts = {p.stem for p in (project_root / "workflow" / "scripts").glob("*.py")}
    text = "".join(p.read_text() for p in (project_root / "workflow" / "rules").glob("*.smk"))
    named = set(re.findall(r'"\.\./scripts/(\w+)\.py"', text))
    assert named == scripts - {"adapter", "gathered"}


def test_scripts_know_nothing_of_the_configuration(project_root):
    """What they read from it would not be among their parameters, and a change would be missed."""
    for script in (project_root / "workflow" / "scripts").glob("*.py"):
        assert ".config" not in re.sub(r"output\.config", "", script.read_text()), script.name


@pytest.mark.parametrize("name", ["default", "slurm"])
def test_profiles_leave_out_the_date_of_scripts_and_go_on_after_a_stop(project_root, name):
    profile = project_root / "workflow" / "profiles" / name / "config.yaml"
    settings = yaml.safe_load(profile.read_text())
    assert settings["rerun-triggers"] == ["mtime", "params", "input", "software-env"]
    assert settings["rerun-incomplete"] is True


def test_the_default_profile_is_where_snakemake_looks(project_root):
    """Beside the Snakefile, which is not the folder of the other profiles."""
    assert (project_root / "profiles" / "default" / "config.yaml").exists()
