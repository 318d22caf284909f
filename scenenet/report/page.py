"""The report: one HTML file that contains everything and opens offline."""

from __future__ import annotations

import base64
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

from scenenet.core.errors import InputError
from scenenet.core.files import write_text
from scenenet.experiments.published import Thesis
from scenenet.report.blocks import Section
from scenenet.report.context import ReportContext, SectionMaker
from scenenet.report.sections import claims as claim_sections
from scenenet.report.sections import crops as crop_sections
from scenenet.report.sections import dataset as dataset_sections
from scenenet.report.sections import lines as line_sections
from scenenet.report.sections import models as model_sections
from scenenet.report.sections import overview
from scenenet.report.sections import parameters as parameter_sections
from scenenet.report.sections import studies as study_sections
from scenenet.report.sections import surveys as survey_sections
from scenenet.report.sections.experiments import EXPERIMENT_SECTIONS
from scenenet.results.folder import Results

TITLE = "Detection of power-line towers in LiDAR surveys with SCENE-Net"
ASSETS = Path(__file__).parent / "assets"

MAIN_EXPERIMENT = "cross_validation"
"""The experiment that is shown first, because every crop counts in it."""

SECTIONS: Sequence[SectionMaker] = (
    claim_sections.claims,
    overview.overview,
    EXPERIMENT_SECTIONS[MAIN_EXPERIMENT],
    model_sections.models,
    model_sections.positions,
    parameter_sections.learned,
    parameter_sections.certificate,
    crop_sections.crops,
    study_sections.studies,
    *(make for name, make in EXPERIMENT_SECTIONS.items() if name != MAIN_EXPERIMENT),
    claim_sections.open_claims,
    claim_sections.published_numbers,
    survey_sections.predictions,
    line_sections.lines,
    line_sections.observers,
    dataset_sections.data,
    dataset_sections.towers,
    dataset_sections.voxels,
    model_sections.training,
    survey_sections.provenance,
)
"""The sections in the order of the page. A section without results is left out."""


def write_report(
    results: Results,
    thesis: Thesis,
    out: str | Path,
    title: str = TITLE,
    *,
    failed: Mapping[str, str] | None = None,
) -> list[Section]:
    """Write the report of a result folder from its tables, figures and predictions.

    Args:
        results: the result folder; its ``tables`` and ``figures`` are shown as they are.
        thesis: published numbers.
        out: HTML file to write; needs no other file and no network. It links to the pages of
            classified surveys.
        title: of the page.
        failed: new surveys that cannot be used -> why.

    Returns:
        the sections of the page.

    Raises:
        InputError: a result file is broken, or a figure is missing.
    """
    context = ReportContext(results, thesis, Path(out).parent, failed or {})
    made = [section for make in SECTIONS if (section := make(context)) is not None]
    write_text(out, render(made, title, "scenenet report", thesis.source))
    return made


def render(
    made: Sequence[Section],
    title: str,
    generator: str,
    source: str | None = None,
    made_by: str | None = None,
) -> str:
    """Sections as an HTML page.

    Args:
        generator: says in the head of the page what wrote it.
        source: of the published numbers on the page, for the footer; None if it has none.
        made_by: what made the page, as a sentence for the footer.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(ASSETS),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"data_uri": data_uri, "png_size": png_size}
    style = Markup((ASSETS / "style.css").read_text(encoding="utf-8"))
    script = Markup((ASSETS / "page.js").read_text(encoding="utf-8"))
    page = environment.get_template("page.html")
    return page.render(
        title=title,
        sections=made,
        style=style,
        script=script,
        generator=generator,
        source=source,
        made_by=made_by,
    )


def data_uri(path: Path) -> str:
    """A PNG as a ``data:`` address."""
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")


def png_size(path: Path) -> tuple[int, int]:
    """Width and height in pixels, so that the page does not jump while pictures are decoded.

    Raises:
        InputError: the file is not a PNG.
    """
    with path.open("rb") as stream:
        head = stream.read(24)
    if len(head) < 24 or head[:8] != b"\x89PNG\r\n\x1a\n":
        raise InputError("is not a PNG picture", file=path, remedy="Delete it and run again")
    return struct.unpack(">II", head[16:24])
