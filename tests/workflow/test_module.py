"""Another repository uses the workflow as a Snakemake module, with its own sheet and settings."""

from __future__ import annotations

from pathlib import Path

import pytest

pytestmark = pytest.mark.workflow

SNAKEFILE = """\
configfile: "own.yaml"


module scenenet:
    snakefile:
        "{root}/workflow/Snakefile"
    {prefix}config:
        config


use rule * from scenenet as scenenet_*


rule list_of_towers:
    default_target: True
    input:
        towers="{folder}results/predict/own/own.towers.geojson",
        report=rules.scenenet_report.output.report,
    output:
        towers="towers.geojson",
    shell:
        "cp {{input.towers}} {{output.towers}}"
"""
SETTINGS = """\
dataset: ours
surveys: ours.tsv
seeds: [0]
studies: []
synthetic:
  surveys:
    - { name: first, towers: 6, seed: 1, density: 12, tower_density: 24 }
"""
SHEET = """\
survey\tpath\tcodes\trole
first\t{results_dir}/synthetic/first.laz\tedp\ttrain
own\tdata/own.laz\tedp\tnew
"""


@pytest.fixture
def other(tmp_path: Path, project_root: Path, recorded: Path, project_in):
    """A function that makes another repository. With a prefix the results are in a folder of that
    name."""

    def make(prefix: str = ""):
        folder = f"{prefix}/" if prefix else ""
        modifier = f'prefix:\n        "{prefix}"\n    ' if prefix else ""
        text = SNAKEFILE.format(root=project_root, prefix=modifier, folder=folder)
        (tmp_path / "Snakefile").write_text(text)
        (tmp_path / "own.yaml").write_text(SETTINGS)
        (tmp_path / "ours.tsv").write_text(SHEET)
        (tmp_path / "data").mkdir()
        (tmp_path / "data" / "own.laz").write_bytes(recorded.read_bytes())
        return project_in(tmp_path)

    return make


@pytest.mark.parametrize("prefix", ["", "detection"])
def test_a_module_plans_its_own_surveys_with_the_defaults_of_the_workflow(other, prefix):
    planned = other(prefix).planned("--cores", "1")
    assert planned.pop("list_of_towers") == 1
    jobs = {name.removeprefix("scenenet_"): count for name, count in planned.items()}
    assert all(name.startswith("scenenet_") for name in planned)
    assert jobs["check"] == 2
    assert jobs["synthesize"] == jobs["predict"] == jobs["report"] == 1
    # Three models by default; the studies and all seeds but one are switched off.
    assert (jobs["train_scenenet"], jobs["train_cnn"]) == (2, 1)
    assert "study" not in jobs


def test_a_module_with_a_prefix_runs_and_leaves_surveys_and_database_where_they_are(other):
    project = other("detection")
    targets = ("check/own/report.json", "mlflow/store.json", "config.yaml")
    project.run("--cores", "2", *(f"detection/results/{target}" for target in targets))
    for target in (*targets, "logs/check/own.log", "benchmarks/check/own.tsv"):
        assert (project.folder / "detection" / "results" / target).exists(), target
    assert (project.folder / "mlflow.db").exists()
    assert not (project.folder / "results").exists()


def test_a_mistake_in_the_configuration_of_a_module_is_refused(other):
    message = other().refused("--cores", "1", "--config", "seedss=[0]")
    assert "seedss: there is no such setting. Did you mean 'seeds'?" in message
