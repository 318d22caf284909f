"""What the documentation shows works."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import typer

from scenenet.cli.app import app
from scenenet.geneo import registry
from scenenet.models.scenenet import SceneNet


def test_the_kernel_of_the_guide_can_be_added_as_it_stands_there(project_root, monkeypatch):
    registry.kernel_names()  # those there are stay known when the copy is dropped again
    monkeypatch.setattr(registry, "_KERNELS", dict(registry._KERNELS))
    text = (project_root / "docs" / "kernels.md").read_text()
    exec(re.search(r"```python\n(.*?)```", text, re.DOTALL)[1], {"__name__": "guide"})
    model = SceneNet(["cylinder", "arrow", "slab", "negative_sphere"])
    assert model.n_parameters() == 13
    assert abs(float(model.kernels()[2].sum().detach())) < 1e-3


def test_every_command_of_the_readme_exists(project_root):
    text = (project_root / "README.md").read_text()
    named = set(re.findall(r"^scenenet (\w+)", text, re.MULTILINE))
    assert named == set(typer.main.get_command(app).commands)


@pytest.mark.parametrize("document", ["README.md", "docs"])
def test_every_file_that_the_documentation_links_to_is_there(project_root: Path, document):
    folder = project_root / document
    for page in sorted(folder.glob("*.md")) if folder.is_dir() else [folder]:
        for link in re.findall(r"\]\((?!https?:|#)([^)#]+)", page.read_text()):
            assert (page.parent / link).exists(), f"{page.name} links to {link}"


def test_the_documentation_names_no_machine_path(project_root: Path):
    pages = [project_root / "README.md", *(project_root / "docs").glob("*.md")]
    assert not [p.name for p in pages if re.search(r"/(home|root|work|tmp)/", p.read_text())]
