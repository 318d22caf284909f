"""Parts of the workflow that a configuration switches off are not planned."""

from __future__ import annotations

import re

import pytest
import yaml
from fixtures.project import PARTS, Project, copy_parts

pytestmark = pytest.mark.workflow


@pytest.fixture(scope="module")
def planned_with(project_in, project_root, tmp_path_factory):
    """A function that plans a first run of ``test.yaml`` with or without MLflow and boosted trees,
    and gives its rules."""
    project: Project = project_in(tmp_path_factory.mktemp("switches") / "project")
    copy_parts(project_root, project.folder, PARTS)
    test = yaml.safe_load((project.folder / "config" / "test.yaml").read_text())

    def plan(*, tracking: bool = True, boosted_trees: bool = True) -> set[str]:
        switches = {"tracking": {"run": tracking}, "boosted_trees": boosted_trees}
        project.configure({**test, **switches})
        return set(project.planned())

    return plan


@pytest.fixture(scope="module")
def everything(planned_with) -> set[str]:
    """The rules of a run with every part."""
    return planned_with()


def test_without_tracking_no_rule_of_mlflow_is_planned(everything, planned_with, project_root):
    text = (project_root / "workflow" / "rules" / "tracking.smk").read_text()
    of_mlflow = set(re.findall(r"^rule (\w+):", text, re.MULTILINE))
    assert len(of_mlflow) > 3 and of_mlflow <= everything
    assert planned_with(tracking=False) == everything - of_mlflow


def test_without_boosted_trees_no_rule_of_them_is_planned(everything, planned_with):
    of_trees = {"boosted_trees", "observer_trees"}
    assert of_trees <= everything
    assert planned_with(boosted_trees=False) == everything - of_trees
