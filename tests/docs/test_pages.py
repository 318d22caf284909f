"""Examples in the documentation work, and everything it names exists."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import doc_tables
import pytest
import typer
import yaml
from figure_tables import tables_of
from kept_runs import Values, read_figures

from scenenet.cli.app import app
from scenenet.config.schema import Config
from scenenet.geneo import kernel_of_file, registry
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import ModelSettings
from scenenet.synthetic.settings import SyntheticSettings

GENERATED = {"docs/reference/cli.md", "docs/reference/settings.md"}
"""Pages that ``tools/doc_site.py`` generates when the site is built."""
SNAKEMAKE = {"set-resources"}
"""Settings of a Snakemake profile in an example."""
CODE = ("scenenet", "workflow", "config", "tests", "tools", "Snakefile", "Makefile")


def _pages(root: Path) -> list[Path]:
    return sorted([*root.glob("*.md"), *(root / "docs").rglob("*.md")])


def _commands(text: str) -> Iterator[str]:
    """The lines of shell examples."""
    for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL):
        yield from block.splitlines()


def test_the_kernel_of_the_guide_can_be_added_unchanged(project_root, monkeypatch, tmp_path):
    registry.kernel_names()  # those there are stay known when the copy is dropped again
    monkeypatch.setattr(registry, "_KERNELS", dict(registry._KERNELS))
    text = (project_root / "docs" / "guides" / "kernels.md").read_text()
    kernel = re.search(r"```python\n(.*?)```", text, re.DOTALL)[1]
    (tmp_path / "slab.py").write_text(kernel)
    assert kernel_of_file(tmp_path / "slab.py").name == "slab"
    exec(kernel, {"__name__": "guide"})
    model = SceneNet(["cylinder", "arrow", "slab", "negative_sphere"])
    assert model.n_parameters() == 13
    assert abs(float(model.kernels()[2].sum().detach())) < 1e-3


def test_the_study_of_the_guide_is_accepted(project_root: Path):
    from scenenet.experiments.studies.settings import StudySettings

    text = (project_root / "docs" / "guides" / "studies.md").read_text()
    shown = yaml.safe_load(re.search(r"```yaml\n(.*?)```", text, re.DOTALL)[1])
    study = StudySettings(**shown["studies"][0])
    assert len(study.all_variants()) == 3


def test_every_setting_in_an_example_is_one_of_the_configuration(project_root: Path):
    known = Config.model_fields.keys() | ModelSettings.model_fields.keys()
    known |= SyntheticSettings.model_fields.keys() | SNAKEMAKE
    examples = 0
    for page in _pages(project_root):
        for block in re.findall(r"```yaml\n(.*?)```", page.read_text(), re.DOTALL):
            examples += 1
            assert yaml.safe_load(block).keys() <= known, f"{page.name}: {block}"
    assert examples > 4


def test_the_tables_in_the_pages_are_those_of_the_code(project_root: Path):
    shown = {}
    for page in _pages(project_root):
        shown |= doc_tables.tables_in(page.read_text())
    measured = tables_of(Values(project_root), read_figures(project_root))
    assert shown.keys() == doc_tables.TABLES.keys() | measured.keys()
    stale = [name for name, make in doc_tables.TABLES.items() if shown[name] != make()]
    assert not stale, "run: python tools/doc_tables.py"


def test_every_command_of_the_readme_exists(project_root):
    text = (project_root / "README.md").read_text()
    named = set(re.findall(r"^scenenet (\w+)", text, re.MULTILINE))
    assert named == set(typer.main.get_command(app).commands)


def test_every_option_in_an_example_is_one_of_its_command(project_root: Path):
    command = typer.main.get_command(app)
    groups = {name: sub for name, sub in command.commands.items() if hasattr(sub, "commands")}
    commands = {"": command, **command.commands}
    for name, group in groups.items():
        commands |= {f"{name} {part}": sub for part, sub in group.commands.items()}
    known = {
        name: {option for p in sub.params for option in p.opts} for name, sub in commands.items()
    }
    any_group = "|".join(groups)
    examples = 0
    for page in _pages(project_root):
        for line in _commands(page.read_text()):
            call = re.match(rf"scenenet (?:((?:(?:{any_group}) )?\w+) )?(.*?)(?:#|$)", line)
            if call:
                examples += 1
                used = set(re.findall(r"(?<!\S)--[\w-]+", call[2]))
                assert used <= known[call[1] or ""], f"{page.name}: {line}"
    assert examples > 10


def test_every_target_of_make_in_an_example_exists(project_root: Path):
    makefile = (project_root / "Makefile").read_text()
    targets = set(re.findall(r"^([a-z]+):", makefile, re.MULTILINE))
    for page in _pages(project_root):
        for line in _commands(page.read_text()):
            if call := re.match(r"make ([a-z]+)", line):
                assert call[1] in targets, f"{page.name}: {line}"


def test_every_file_that_the_documentation_links_to_is_there(project_root: Path):
    for page in _pages(project_root):
        for link in re.findall(r"\]\((?!https?:|#)([^)#]+)", page.read_text()):
            target = (page.parent / link).resolve()
            if str(target.relative_to(project_root)) not in GENERATED:
                assert target.exists(), f"{page.name} links to {link}"


def test_every_module_that_the_documentation_names_is_there(project_root: Path):
    for page in _pages(project_root):
        for name in re.findall(r"`(scenenet/[\w/]+(?:\.py)?)/?`", page.read_text()):
            assert (project_root / name).exists(), f"{page.name} names {name}"


@pytest.mark.parametrize("part", CODE)
def test_every_page_that_the_code_names_is_there(project_root: Path, part):
    folder = project_root / part
    for path in [folder] if folder.is_file() else folder.rglob("*"):
        if path.suffix in {".py", ".yaml", ".smk", ".rst", ".md", ".json", ""} and path.is_file():
            for page in re.findall(r"docs/[\w/]+\.md", path.read_text()):
                assert (project_root / page).exists() or page in GENERATED, f"{path}: {page}"


def test_the_documentation_names_no_machine_path(project_root: Path):
    pages = _pages(project_root)
    assert not [p.name for p in pages if re.search(r"/(home|root|work|tmp)/", p.read_text())]


def test_every_page_is_in_the_navigation(project_root: Path):
    text = (project_root / "mkdocs.yml").read_text()
    listed = {f"docs/{page}" for page in re.findall(r": ([\w/]+\.md)$", text, re.MULTILINE)}
    there = {str(p.relative_to(project_root)) for p in (project_root / "docs").rglob("*.md")}
    assert listed == there | GENERATED
