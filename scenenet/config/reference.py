"""The JSON schemas and the table of settings, generated from the settings models."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from scenenet.clearance.settings import ClearanceLimits
from scenenet.config.errors import model_in
from scenenet.config.observers import ObserverSettings
from scenenet.config.schema import Config
from scenenet.config.survey_settings import SyntheticSurvey
from scenenet.config.survey_sheet import SurveyRow
from scenenet.core.files import write_json, write_text
from scenenet.models.settings import ModelSettings

HEAD = """\
# Settings

`config.yaml` is read on every run. A file given with `--configfile` overrides it: mappings are
merged key by key, lists are replaced. `--config KEY=VALUE` is applied last. A setting that is not
given has the default below. `RESULTS_DIR/config.yaml` has all settings of a run.

| file | what it is for |
|---|---|
| `config.yaml` | the full reproduction, on synthetic surveys |
| `full.yaml` | chapter 5 of the thesis at its own scale, on 2823 synthetic crops |
| `main.yaml` | the main comparison only: `--configfile config/full.yaml config/main.yaml` |
| `demo.yaml` | a survey, its tower map and a report: `make demo` |
| `test.yaml` | every stage in minutes |
| `ts40k.yaml` | real samples of TS40K: `--config ts40k_dir=FOLDER` |
| `studies.yaml` | the studies of the thesis; see `docs/guides/studies.md` |
| `surveys.tsv` | the survey sheet; see `docs/guides/surveys.md` |
| `thesis.yaml` | published numbers |

This page is written by `python -m scenenet.config.reference --reference config/README.md`.
"""

SECTIONS: Mapping[str, type[BaseModel]] = {
    "Everything": Config,
    "Each entry of `models`": ModelSettings,
    "Each entry of `observers`": ObserverSettings,
    "Each entry of `synthetic.surveys`": SyntheticSurvey,
    "Each entry of `clearance.limits`": ClearanceLimits,
}


def schemas() -> dict[str, dict[str, Any]]:
    """File name -> JSON schema."""
    draft = "https://json-schema.org/draft/2020-12/schema"
    return {
        "config.schema.json": {"$schema": draft, **Config.model_json_schema()},
        "surveys.schema.json": {"$schema": draft, **SurveyRow.model_json_schema()},
    }


def write_schemas(folder: str | Path) -> None:
    """Write the JSON schemas as files in ``folder``."""
    for name, schema in schemas().items():
        write_json(Path(folder) / name, schema)


def reference() -> str:
    """The table of settings as Markdown."""
    parts = [HEAD]
    for title, model in SECTIONS.items():
        parts.append(f"## {title}\n")
        parts.append("| setting | default | what it is |\n|---|---|---|")
        for key, field in settings_of(model):
            meaning = (field.description or "").replace("|", "\\|").replace("\n", " ")
            parts.append(f"| `{key}` | {_default(field)} | {meaning} |")
        parts.append("")
    return "\n".join(parts)


def write_reference(path: str | Path) -> None:
    """Write the table of settings as a Markdown file."""
    write_text(path, reference())


def settings_of(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """Dotted name and field of every setting that is not a group of settings."""
    for name, field in model.model_fields.items():
        annotation = field.annotation
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            yield from settings_of(annotation, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", field


def _default(field: FieldInfo) -> str:
    value = field.get_default(call_default_factory=True)
    if value is PydanticUndefined:
        return "(must be given)"
    if model_in(field.annotation) is not None:
        return f"({len(value)} entries)" if value else "(none)"
    return f"`{json.dumps(value)}`"


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m scenenet.config.reference", description=__doc__
    )
    parser.add_argument("--schema", metavar="FOLDER", help="write the JSON schemas into it")
    parser.add_argument("--reference", metavar="FILE", help="write the table of settings to it")
    chosen = parser.parse_args()
    if chosen.schema is None and chosen.reference is None:
        parser.error("give --schema, --reference or both")
    if chosen.schema is not None:
        write_schemas(chosen.schema)
    if chosen.reference is not None:
        write_reference(chosen.reference)


if __name__ == "__main__":
    main()
