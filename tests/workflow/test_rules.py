"""All rules have their directives in one order, and profiles and environments agree."""

from __future__ import annotations

import re

import pytest
import yaml

FORM = [
    *("input", "output", "log", "benchmark", "conda"),
    *("threads", "resources", "params", "message", "script"),
]
OPTIONAL = {"input"}  # the first rules have none


def rules(root) -> dict[str, dict[str, list[str]]]:
    """Name of each rule, or file and line where it has none -> directive -> its lines, without the
    indentation that they have in common."""
    found: dict[str, dict[str, list[str]]] = {}
    for file in sorted((root / "workflow" / "rules").glob("*.smk")):
        rule = None
        for number, line in enumerate(file.read_text().splitlines(), 1):
            if start := re.match(r"( *)(?:rule|checkpoint) ?(\w*):$", line):
                indent = f"{start[1]}    "
                rule = found[start[2] or f"{file.name}:{number}"] = {}
            elif re.match(r"\S", line):
                rule = None
            elif rule is not None and (directive := re.match(rf"{indent}(\w+):", line)):
                lines = rule[directive[1]] = []
            elif rule is not None and line.strip():
                lines.append(line.removeprefix(f"{indent}    "))
    return found


def test_every_rule_has_its_directives_in_order(project_root):
    found = rules(project_root)
    assert len(found) > 30
    for name, directives in found.items():
        filled = [directive for directive in directives if directive in FORM]
        assert filled == [d for d in FORM if d in filled], name
        assert set(FORM) - set(filled) <= OPTIONAL, name


def test_every_input_and_output_has_a_name_and_the_parameter_is_one_dict(project_root):
    for name, directives in rules(project_root).items():
        for directive in ("input", "output", "params"):
            entries = [e for e in directives.get(directive, []) if re.match(r"[^\s)\]}#]", e)]
            unnamed = [e for e in entries if not re.match(r"\w+=|\*\*\w+\(", e)]
            assert not unnamed, (name, directive)
        assert [e.partition("=")[0] for e in directives["params"] if e[0] not in " )#"] == ["job"]


def test_every_stage_has_a_script_and_every_script_a_rule(project_root):
    scripts = {p.stem for p in (project_root / "workflow" / "scripts").glob("*.py")}
    text = "".join(p.read_text() for p in (project_root / "workflow" / "rules").glob("*.smk"))
    named = set(re.findall(r'"\.\./scripts/(\w+)\.py"', text))
    assert named == scripts - {"_job", "_results"}


def test_scripts_know_nothing_of_the_configuration(project_root):
    """A value that they read from it would not be a parameter, so a change would go unnoticed."""
    for script in (project_root / "workflow" / "scripts").glob("*.py"):
        assert ".config" not in re.sub(r"output\.config", "", script.read_text()), script.name


@pytest.mark.workflow
def test_snakemake_finds_nothing_to_improve(finished):
    done = finished.snakemake("--lint")
    assert done.returncode == 0, done.stdout
    assert "your workflow is in a good condition" in done.stdout


@pytest.mark.parametrize("name", ["default", "slurm"])
def test_profiles_ignore_the_date_of_scripts_and_continue_after_a_stop(project_root, name):
    profile = project_root / "workflow" / "profiles" / name / "config.yaml"
    settings = yaml.safe_load(profile.read_text())
    assert settings["rerun-triggers"] == ["mtime", "params", "input", "software-env"]
    assert settings["rerun-incomplete"] is True


def test_the_default_profile_is_where_snakemake_looks(project_root):
    """Next to the Snakefile, which is not the folder of the other profiles."""
    assert (project_root / "profiles" / "default" / "config.yaml").exists()


def test_the_workflow_has_what_the_snakemake_catalog_asks_for(project_root):
    usage = yaml.safe_load((project_root / ".snakemake-workflow-catalog.yml").read_text())["usage"]
    assert set(usage) == {"mandatory-flags", "software-stack-deployment"}
    assert set(usage["mandatory-flags"]) == {"desc", "flags"}
    deployment = usage["software-stack-deployment"]
    assert deployment["conda"] is True
    assert deployment["report"] is True
    assert (project_root / "workflow" / "Snakefile").exists()
    assert (project_root / "config" / "README.md").exists()


def test_the_environment_of_the_jobs_has_the_tested_versions(project_root):
    environment = yaml.safe_load((project_root / "workflow/envs/scenenet.yaml").read_text())
    (pip,) = (entry["pip"] for entry in environment["dependencies"] if isinstance(entry, dict))
    tested = (project_root / "constraints.txt").read_text().lower().splitlines()
    assert len(pip) > 10
    for requirement in pip:
        assert re.sub(r"\[.*\]", "", requirement) in tested
