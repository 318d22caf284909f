"""Pages of the documentation that are generated from the code: settings, command line and API.

``mkdocs.yml`` names this file as a hook, so ``mkdocs build`` calls the functions ``on_*``.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parent.parent
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))  # document this checkout, whichever version is installed

SETTINGS, CLI, API = "reference/settings.md", "reference/cli.md", "reference/api"
"""Pages that stand in the navigation of ``mkdocs.yml`` and not in ``docs/``."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Add a page for each package to the navigation, under Reference."""
    pages: list[Any] = [{package: f"{API}/{package}.md"} for package in packages()]
    for section in config.nav or []:
        if "Reference" in section:
            section["Reference"].append({"Python API": pages})
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    pages = {SETTINGS: settings_page(), CLI: cli_page()}
    pages |= {f"{API}/{package}.md": api_page(package) for package in packages()}
    for path, text in pages.items():
        files.append(File.generated(config, path, content=text))
    return files


def packages() -> list[str]:
    """Names of the packages below ``scenenet``, in the order of the import contract."""
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    layers: list[str] = contract["contracts"][0]["layers"]
    return layers[::-1]


def api_page(package: str) -> str:
    """A page with every module of one package, for mkdocstrings to fill in."""
    folder = ROOT / "scenenet" / package
    modules = []
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if any(part.startswith("_") and part != "__init__" for part in parts):
            continue
        modules.append(".".join(part for part in parts if part != "__init__"))
    modules.sort(key=lambda name: (name.count("."), name))
    return "\n\n".join([f"# scenenet.{package}", *(f"::: {module}" for module in modules)]) + "\n"


def settings_page() -> str:
    """Every setting, from the pydantic models."""
    from scenenet.config.reference import reference

    return reference()


def cli_page() -> str:
    """Every command with its arguments and options, from typer."""
    import click
    import typer
    from typer.cli import get_docs_for_click

    from scenenet.cli.app import app

    command = typer.main.get_command(app)
    context = click.Context(command, info_name="scenenet")
    text: str = get_docs_for_click(obj=command, ctx=context, name="scenenet")
    return text.replace("# `scenenet`", "# Command line\n\n`scenenet`", 1)
