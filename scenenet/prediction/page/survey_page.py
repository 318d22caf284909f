"""Writes the page of a survey: one HTML file that needs no other file and no network."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from scenenet.core.columns import FieldColumn
from scenenet.core.files import write_text
from scenenet.detection.settings import DetectionSettings
from scenenet.detection.survey_tower import TOWER_COLUMNS, SurveyTower
from scenenet.interpretability.explanations import TowerExplanation, explanations, meanings
from scenenet.pointcloud.units import SYMBOLS
from scenenet.prediction.file_status import SurveyFile
from scenenet.prediction.page.map_shapes import MapFrame, frame_and_shapes
from scenenet.prediction.page.pictures import STEP_M, TowerPicture, radius_of, tower_pictures

if TYPE_CHECKING:
    from scenenet.prediction.survey_prediction import SurveyPrediction

ASSETS = Path(__file__).parent / "assets"

PAGE_BYTES = 100_000
"""Size of a page without towers, and of that of a survey that is little more than one tower. What
towers add is less than a hundredth of the points around them."""

DECIMALS = {"m": 2, "1": 3, "": 0}
"""Decimals of the values of a column, by its unit."""

MOST_WARNINGS = 10
"""Most warnings on the page: a survey of hundreds of files may have as many."""

LISTED = tuple(column for column in TOWER_COLUMNS if column.heading is not None)
"""The columns of the tower list that are for people."""

FOUND, TO_CHECK = "found", "to check"


def write_page(prediction: SurveyPrediction, path: str | Path) -> None:
    """Write the page of a survey. Equal predictions give equal pages.

    Raises:
        OutputError: the page cannot be written.
    """
    write_text(path, survey_page(prediction, tower_pictures(prediction)))


def survey_page(prediction: SurveyPrediction, drawn: Iterable[TowerPicture]) -> str:
    """The page of a survey as HTML.

    Args:
        drawn: a picture of each tower.
    """
    units = (prediction.unit_sizes, prediction.unit_names)
    explained = explanations(prediction.towers, prediction.card, *units)
    doubtful = {one.id for one in explained if one.doubts}
    frame, shapes = frame_and_shapes(prediction, doubtful)
    planar, _, vertical = (SYMBOLS.get(name, name) for name in prediction.unit_names)
    name = prediction.survey.given.name
    style, script = ((ASSETS / file).read_text("utf-8") for file in ("page.css", "page.js"))
    return Template((ASSETS / "page.html").read_text("utf-8")).substitute(
        title=escape(f"Towers of {name}"),
        style=style,
        script=script,
        style_hash=_hash(f"\n{style}"),
        script_hash=_hash(f"\n{script}"),
        facts=_facts(_counts(prediction, len(doubtful))),
        warnings=_warnings(prediction),
        caveat=_note("What this page does not show", not_seen(prediction.detection)),
        shapes=shapes,
        headings=_headings(planar, vertical),
        rows="\n".join(_row(t, t.id in doubtful) for t in prediction.towers),
        files=_files(prediction.files),
        parameters=_parameters(prediction),
        data=_json(_data(prediction, explained, frame, planar, vertical)),
        pictures="\n".join(_picture(picture) for picture in drawn),
    )


def not_seen(detection: DetectionSettings) -> list[str]:
    """What the list of towers does not show, as sentences."""
    sentences = [
        "Nobody has confirmed these towers. Look at each before you act on it.",
        f"Towers lower than {detection.min_height:g} m are not in the list.",
        "A tower of which the survey has too few points is not in the list.",
    ]
    if detection.min_conductor > 0:
        sentences.insert(2, "Towers without conductors in the data are not in the list.")
    sentences.append(
        "A probability ranks the places of one survey. It is not the share of right answers."
    )
    return sentences


def _counts(prediction: SurveyPrediction, doubtful: int) -> list[tuple[str, str]]:
    card, files = prediction.card, prediction.files
    of = {s: sum(f.status == s for f in files) for s in ("predicted", "failed", "left out")}
    names = dict.fromkeys(prediction.unit_names[1:])
    return [
        ("towers", _count(len(prediction.towers))),
        ("of these to check", _count(doubtful)),
        ("points", _count(prediction.n_points)),
        ("files read", _count(of["predicted"])),
        ("files failed", _count(of["failed"])),
        ("files left out", _count(of["left out"])),
        ("model", card.name),
        ("tau", f"{card.threshold():.3f}"),
        ("voxel size", f"{prediction.voxel_size:.2f} m"),
        ("CRS", "not known" if prediction.crs is None else _system(prediction)),
        ("unit", " (x, y), ".join(names) + (" (z)" if len(names) > 1 else "")),
    ]


def _system(prediction: SurveyPrediction) -> str:
    crs = prediction.crs
    if crs is None:
        return ""
    code = crs.to_authority()
    return crs.name if code is None else f"{crs.name} ({':'.join(code)})"


def _warnings(prediction: SurveyPrediction) -> str:
    found: dict[str, list[str]] = {text: [] for text in prediction.survey.notes}
    for file in prediction.files:
        for text in file.warnings:
            found.setdefault(text, []).append(file.name)
    warnings = [text if not names else f"{text} ({_named(names)})" for text, names in found.items()]
    unused = sum(file.error is not None for file in prediction.files)
    if unused:
        text = f"not used: {unused} of {len(prediction.files)} files; their towers are not known"
        warnings.insert(0, text)
    if len(warnings) > MOST_WARNINGS:
        more = len(warnings) - MOST_WARNINGS
        warnings[MOST_WARNINGS:] = [f"{more} more warnings, which are in the summary of the survey"]
    return _note("Warnings", warnings) if warnings else ""


def _named(files: Sequence[str]) -> str:
    """The first of some files, and how many there are besides."""
    first, *others = files
    return f"{first} and {len(others)} more file{'s' * (len(others) > 1)}" if others else first


def _note(title: str, sentences: Iterable[str]) -> str:
    items = "".join(f"<li>{escape(text)}</li>" for text in sentences)
    return f'<div class="notes"><h2>{escape(title)}</h2><ul>{items}</ul></div>\n'


def _facts(pairs: Iterable[tuple[str, str]]) -> str:
    return "".join(
        f"<div><dt>{escape(name)}</dt><dd>{escape(text)}</dd></div>" for name, text in pairs
    )


def _headings(planar: str, vertical: str) -> str:
    titles = []
    for column in LISTED:
        unit = f" [{vertical if column.vertical else planar}]" if column.unit == "m" else ""
        titles.append((f"{column.heading}{unit}", column.description, "number"))
    titles.insert(1, ("state", "to check: there is a reason to doubt it", "text"))
    return "".join(
        f'<th scope="col" class="{kind}" title="{escape(description)}">'
        f'<button type="button">{escape(title)}</button></th>'
        for title, description, kind in titles
    )


def _row(tower: SurveyTower, doubtful: bool) -> str:
    name, *others = LISTED
    cells = "".join(f'<td class="number">{_text(column, tower)}</td>' for column in others)
    state = TO_CHECK if doubtful else FOUND
    kind = "check" if doubtful else "found"
    return (
        f'<tr data-tower="{tower.id}" class="{kind}"><th scope="row" class="number">'
        f'<button type="button" tabindex="-1">{name.value(tower)}</button></th>'
        f'<td><span class="state">{state}</span></td>{cells}</tr>'
    )


def _text(column: FieldColumn, tower: SurveyTower) -> str:
    return f"{column.value(tower):.{DECIMALS[column.unit]}f}"


def _files(files: Sequence[SurveyFile]) -> str:
    """The table of the files, those that were not used first."""
    rows = [file.to_json() for file in sorted(files, key=lambda file: file.error is None)]
    head = "".join(f'<th scope="col">{escape(name.replace("_", " "))}</th>' for name in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(value))}</td>" for value in row.values()) + "</tr>\n"
        for row in rows
    )
    return f"<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody>"


def _parameters(prediction: SurveyPrediction) -> str:
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


def _data(
    prediction: SurveyPrediction,
    explained: Sequence[TowerExplanation],
    frame: MapFrame,
    planar: str,
    vertical: str,
) -> dict[str, Any]:
    """What the script of the page needs."""
    planar_m, _, vertical_m = prediction.unit_sizes
    towers = [
        {
            "id": tower.id,
            "x": round(tower.x, 3),
            "y": round(tower.y, 3),
            "height_m": round(tower.height * vertical_m, 2),
            "radius_m": round(radius_of(tower.height * vertical_m), 2),
            "bearings": [round(bearing, 1) for bearing in tower.conductor_bearings],
            "evidence": one.evidence,
            "shares": [(name, round(share, 3), text) for name, share, text in one.contributions],
            "doubts": one.doubts,
        }
        for tower, one in zip(prediction.towers, explained, strict=True)
    ]
    return {
        "west": frame.west,
        "north": frame.north,
        "width": frame.width,
        "height": frame.height,
        "planar": planar,
        "planar_m": planar_m,
        "vertical": vertical,
        "vertical_m": vertical_m,
        "step_m": STEP_M,
        "towers": towers,
    }


def _picture(picture: TowerPicture) -> str:
    return (
        f'<script type="text/plain" id="points-{picture.tower}" data-own="{picture.own}">'
        f"{picture.packed()}</script>"
    )


def _json(data: dict[str, Any]) -> str:
    """JSON that may stand in a script element, whatever its texts are."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace("&", "\\u0026")


def _hash(text: str) -> str:
    """What the Content-Security-Policy of the page says of a style or script that may apply."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"sha256-{base64.b64encode(digest).decode('ascii')}"


def _count(number: int) -> str:
    """A count with narrow spaces between thousands."""
    return f"{number:,}".replace(",", "\u202f")
