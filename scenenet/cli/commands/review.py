"""``scenenet review``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scenenet.cli.inputs import Failures
from scenenet.cli.options import AsJson, Codes, FoundTowers, Overwrite, coordinate_system
from scenenet.cli.output import show
from scenenet.pointcloud.class_schemes import class_scheme, difference

if TYPE_CHECKING:
    from scenenet.review.found_list import FoundList
    from scenenet.review.reviewed_files import Labelling

EXAMPLES = (
    "scenenet review found/ --template review.csv",
    "scenenet review found/ --decisions review.csv",
    "scenenet review found/ --decisions review.csv --labels labelled.laz --codes asprs",
)


Decisions = Annotated[
    list[Path] | None,
    typer.Option(
        "--decisions",
        metavar="FILE",
        help="Review file: CSV, or a GeoPackage with a layer review. May be repeated.",
    ),
]
Template = Annotated[
    Path | None,
    typer.Option(
        "--template",
        metavar="FILE",
        help="Write a review file to fill in (.csv, .gpkg), the doubtful towers first.",
    ),
]
Out = Annotated[
    Path | None,
    typer.Option("--out", help="Folder for the reviewed list.  [default: the folder of the list]"),
]
Labels = Annotated[
    Path | None,
    typer.Option(
        "--labels",
        metavar="OUT",
        help="Survey to write with the review as labels, for train and evaluate: a .laz file, "
        "or a folder for a survey of several files. Needs --codes.",
    ),
]
LabelScheme = Annotated[
    Codes | None,
    typer.Option("--codes", help=f"Class scheme of the labels ({difference()})."),
]
AcceptRest = Annotated[
    bool,
    typer.Option("--accept-rest", help="With --labels: label towers without a decision too."),
]
System = Annotated[
    str | None,
    typer.Option(
        "--crs",
        metavar="SYSTEM",
        help="Coordinate system of review files that state none.  [default: that of the survey]",
    ),
]


def command(
    found: FoundTowers,
    decisions: Decisions = None,
    template: Template = None,
    out: Out = None,
    labels: Labels = None,
    codes: LabelScheme = None,
    accept_rest: AcceptRest = False,
    crs: System = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Merge what people decided about the towers and conductors of a survey.

    A review file has a row for each decision: accept, reject, add or comment, with the id of the
    tower or its x and y, and a comment, a reviewer, and for an added tower its base and height.
    --template writes one with every tower, the doubtful ones first, each with the reasons. Where
    a line was found it has every conductor too, to accept, reject or comment on.

    NAME.reviewed.csv, .geojson and .gpkg have the towers that were not rejected, with their
    decisions. NAME.rejected.csv and the layer rejected have the others. NAME.reviewed.json is the
    record. NAME.reviewed.gpkg has the conductors in the layers conductors and
    rejected_conductors. To leave rejected conductors out of spans, clearances and the page,
    predict the survey again with --decisions.

    --labels writes a copy of the points beside the list in which the points of accepted and added
    towers are labelled tower, and those of rejected ones are not.

    A row that contradicts another one, or names a tower that is not there, is an error; nothing is
    written then.
    """
    from scenenet.review.found_list import find_list

    if (decisions is None) == (template is None):
        raise typer.BadParameter("give either --decisions or --template", param_hint="--decisions")
    if (labels is None) != (codes is None):
        raise typer.BadParameter("give --labels and --codes, or neither", param_hint="--labels")
    if labels is None and accept_rest:
        raise typer.BadParameter("needs --labels", param_hint="--accept-rest")
    if template is not None and (out is not None or labels is not None):
        raise typer.BadParameter("cannot be used with --template", param_hint="--out, --labels")
    towers = find_list(found)
    if template is not None:
        _template(towers, template, overwrite, as_json)
        return
    labelling = _labelling(towers, labels, codes, accept_rest)
    _merge(towers, decisions or [], out, labelling, crs, overwrite, as_json)


def _template(towers: FoundList, template: Path, overwrite: bool, as_json: bool) -> None:
    from scenenet.core.outputs import Output, check_outputs
    from scenenet.review.template import write_template

    # A file that is there may have been filled in.
    check_outputs([Output(template, lambda _: False)], [towers.path], overwrite=overwrite)
    doubted = write_template(template, towers)
    if towers.tau is None:
        print(
            f"warning: {towers.path}: {towers.name}.summary.json is not beside it, so tau is not "
            "known and no probability is doubted",
            file=sys.stderr,
        )
    result = {
        "template": str(template),
        "towers": [{"id": each.tower.id, "doubts": list(each.reasons)} for each in doubted],
        "conductors": len(towers.conductors),
    }
    show(result, as_json, _template_lines)


def _template_lines(result: dict[str, Any]) -> list[str]:
    towers = result["towers"]
    doubted = sum(bool(tower["doubts"]) for tower in towers)
    wires = f", and {result['conductors']} conductors" if result["conductors"] else ""
    return [
        f"{result['template']}: {len(towers)} towers to review, {doubted} of them doubtful{wires}"
    ]


def _labelling(
    towers: FoundList, labels: Path | None, codes: Codes | None, accept_rest: bool
) -> Labelling | None:
    if labels is None or codes is None:
        return None
    from scenenet.review.labels.labelled_survey import LabelFiles
    from scenenet.review.reviewed_files import Labelling

    return Labelling(LabelFiles.of(towers, labels), class_scheme(codes.value), accept_rest)


def _merge(
    towers: FoundList,
    decisions: list[Path],
    out: Path | None,
    labelling: Labelling | None,
    crs: str | None,
    overwrite: bool,
    as_json: bool,
) -> None:
    from scenenet.core.errors import InputError
    from scenenet.core.outputs import check_outputs, check_space
    from scenenet.review.decisions import read_decisions
    from scenenet.review.merge import merge
    from scenenet.review.reviewed_files import ReviewedFiles, write_review

    if towers.is_reviewed:
        raise InputError(
            "this list was reviewed already",
            file=towers.path,
            remedy="Name the list of the prediction, and every review file with --decisions",
        )
    files = ReviewedFiles.of(towers, out or towers.path.parent, labelling)
    points = {} if labelling is None else labelling.files.files
    inputs = [*decisions, towers.path, *points]
    check_outputs(files.recorded.outputs(), inputs, overwrite=overwrite)
    check_space({target: source.stat().st_size for source, target in points.items()})
    statements = read_decisions(decisions, towers, coordinate_system(crs))
    review, errors = merge(towers, statements)
    failures = Failures()
    failures.errors += errors
    failures.end()
    for text in (*review.unmatched, *review.warnings):
        print(f"warning: {text}", file=sys.stderr)
    result = write_review(review, towers, decisions, files)
    if review.conductors is not None and (named := review.conductors.rejected()):
        print(
            f"rejected: {named}. To leave them out of spans, clearances and the page, predict the "
            "survey again with --decisions",
            file=sys.stderr,
        )
    show(result, as_json, _lines)


def _lines(result: dict[str, Any]) -> list[str]:
    counts = result["counts"]
    lines = [
        f"{counts['found']} towers found: {counts['accepted']} accepted, {counts['rejected']} "
        f"rejected, {counts['not_reviewed']} not reviewed; {counts['added']} added, "
        f"{counts['comments']} with a comment"
    ]
    if (wires := result["conductors"]) is not None:
        lines.append(
            f"{wires['found']} conductors found: {wires['accepted']} accepted, "
            f"{wires['rejected']} rejected, {wires['not_reviewed']} not reviewed, "
            f"{wires['comments']} with a comment"
        )
    if result["unmatched"]:
        lines.append(f"{len(result['unmatched'])} rows match no tower or conductor")
    if (labels := result["labels"]) is not None:
        lines.append(
            f"{labels['tower_points']:,} points labelled tower in {', '.join(labels['files'])}"
        )
        lines += [
            f"tower {number} was added, but no body stands at its place: it has no label"
            for number in labels["without_body"]
        ]
    return lines
