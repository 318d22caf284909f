"""What a page says of a survey as a whole: counts, warnings, files, and what it does not show."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from scenenet.detection.settings import DetectionSettings
from scenenet.interpretability.explanations import meanings
from scenenet.line.records import AS_FLOWN
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.page.budget import (
    MOST_FILES,
    OTHER_POINTS,
    OWN_POINTS,
    SPAN_POINTS,
    PageBudget,
)
from scenenet.prediction.page.markup import count, note
from scenenet.prediction.page.span_facts import DANGER, SpanFacts

if TYPE_CHECKING:
    from scenenet.prediction.survey_prediction import SurveyPrediction

MOST_WARNINGS = 10
"""Most warnings on the page: a survey of hundreds of files may have as many."""


def not_seen(detection: DetectionSettings) -> list[str]:
    """What the list of towers does not show, as sentences."""
    sentences = [
        "These towers are not confirmed. Check each before you act on it.",
        f"Towers lower than {detection.min_height:g} m are not in the list.",
        "A tower of which the survey has too few points is not in the list.",
    ]
    if detection.min_conductor > 0:
        sentences.insert(2, "Towers without conductors in the data are not in the list.")
    sentences.append(
        "A probability ranks the places of one survey. It is not the share of right answers."
    )
    return sentences


def positions_said(prediction: SurveyPrediction) -> str:
    """What the positions of conductors on the page are."""
    wires = () if prediction.line is None else prediction.line.conductors
    said = sorted({wire.positions for wire in wires}) or [AS_FLOWN]
    return f"Conductors are {', others '.join(said)}"


def line_not_seen(prediction: SurveyPrediction) -> list[str]:
    """What the spans do not show, as sentences."""
    sentences = [
        f"{positions_said(prediction)}.",
        "A wire that the survey has few points of may be missing, and so may what is near it.",
    ]
    found = prediction.clearances
    if found is not None:
        sentences.append(f"Ground, vegetation and buildings: {found.kinds}.")
        sentences.append(
            f"Limits: {found.limits}."
            if found.limits
            else "There are no limits, because no voltage was named (--voltage): places are sorted "
            "by their distance."
        )
    return sentences


def counts(
    prediction: SurveyPrediction, doubtful: int, spans: Sequence[SpanFacts]
) -> list[tuple[str, str]]:
    """The facts at the top of the page, as name and value.

    Args:
        doubtful: number of towers to check.
        spans: of its line; none where no line was looked for.
    """
    card, files = prediction.card, prediction.files
    of = {s: sum(f.status == s for f in files) for s in ("predicted", "failed", "left out")}
    names = dict.fromkeys(prediction.unit_names[1:])
    return [
        ("towers", count(len(prediction.towers))),
        ("of these to check", count(doubtful)),
        *(_line_counts(prediction, spans) if prediction.line is not None else ()),
        ("points", count(prediction.n_points)),
        ("files read", count(of["predicted"])),
        ("files failed", count(of["failed"])),
        ("files left out", count(of["left out"])),
        ("model", card.name),
        ("tau", f"{card.threshold():.3f}"),
        ("voxel size", f"{prediction.voxel_size:.2f} m"),
        ("CRS", "not known" if prediction.crs is None else _system(prediction)),
        ("unit", " (x, y), ".join(names) + (" (z)" if len(names) > 1 else "")),
    ]


def _line_counts(prediction: SurveyPrediction, spans: Sequence[SpanFacts]) -> list[tuple[str, str]]:
    found = [("spans", count(sum(one.span.line > 0 for one in spans)))]
    clearances = prediction.clearances
    if clearances is not None and clearances.limits:
        dangers = sum(one.state == DANGER for one in spans)
        found += [
            ("spans with a place too near", count(dangers)),
            ("voltage", clearances.limits.partition(":")[0]),
        ]
    if clearances is not None:
        found.append(("trees that could fall on it", count(len(clearances.trees))))
    return found


def _system(prediction: SurveyPrediction) -> str:
    crs = prediction.crs
    if crs is None:
        return ""
    code = crs.to_authority()
    return crs.name if code is None else f"{crs.name} ({':'.join(code)})"


def warnings(prediction: SurveyPrediction, budget: PageBudget) -> str:
    """The box with what looks wrong, and with what the page leaves out."""
    found: dict[str, list[str]] = {text: [] for text in prediction.survey.notes}
    for file in prediction.files:
        for text in file.warnings:
            found.setdefault(text, []).append(file.name)
    texts = [text if not names else f"{text} ({_named(names)})" for text, names in found.items()]
    unused = sum(file.error is not None for file in prediction.files)
    if unused:
        text = f"not used: {unused} of {len(prediction.files)} files; their towers are not known"
        texts.insert(0, text)
    if len(texts) > MOST_WARNINGS:
        more = len(texts) - MOST_WARNINGS
        texts[MOST_WARNINGS:] = [f"{more} more warnings, which are in the summary of the survey"]
    texts += left_out(budget, len(prediction.towers), _n_spans(prediction))
    return note("Warnings", texts) if texts else ""


def left_out(budget: PageBudget, n_towers: int, n_spans: int) -> list[str]:
    """What a page leaves out of a survey with so many towers and spans, as sentences."""
    texts = []
    for what, listed, n, kind in (
        ("towers", budget.towers, n_towers, "to check"), ("spans", budget.spans, n_spans, "worst")
    ):  # fmt: skip
        if listed < n:
            texts.append(
                f"this page has the first {count(listed)} of {count(n)} {what}, those {kind} first;"
                " the GeoPackage and the CSV files have all"
            )
    if budget.share < 1:
        texts.append(
            f"pictures have fewer points, because the survey is large: at most "
            f"{count(budget.points(OWN_POINTS + OTHER_POINTS))} of a tower"
            + (f" and {count(budget.points(SPAN_POINTS))} of a span" if n_spans else "")
        )
    return texts


def _n_spans(prediction: SurveyPrediction) -> int:
    return 0 if prediction.line is None else len(prediction.line.spans)


def _named(files: Sequence[str]) -> str:
    """The first of some files, and how many there are besides."""
    first, *others = files
    return f"{first} and {len(others)} more file{'s' * (len(others) > 1)}" if others else first


def shown_files(files: Sequence[SurveyFile]) -> list[SurveyFile]:
    """The files that a page shows, those that were not used first."""
    return sorted(files, key=lambda file: file.error is None)[:MOST_FILES]


def file_table(files: Sequence[SurveyFile]) -> str:
    """The table of the files."""
    shown = shown_files(files)
    rows = [file.to_json() for file in shown]
    head = "".join(f'<th scope="col">{escape(name.replace("_", " "))}</th>' for name in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(value))}</td>" for value in row.values()) + "</tr>\n"
        for row in rows
    )
    more = len(files) - len(shown)
    caption = f"<caption>{count(more)} more files are in the list of files</caption>" * (more > 0)
    return f"{caption}<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody>"


def parameter_table(prediction: SurveyPrediction) -> str:
    """The table of the parameters of the model; a sentence where they have no meaning."""
    rows = meanings(prediction.model, prediction.card)
    if not rows:
        return "<p>The weights of this model have no meaning of their own.</p>"
    body = "".join(
        f'<tr><td>{escape(name)}</td><td class="number">{value:.4g}</td>'
        f"<td>{escape(unit)}</td><td>{escape(meaning)}</td></tr>\n"
        for name, value, unit, meaning in rows
    )
    head = "".join(
        f'<th scope="col">{text}</th>' for text in ("parameter", "value", "unit", "meaning")
    )
    return f"<table><thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table>"
