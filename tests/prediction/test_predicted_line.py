"""The line of a survey: conductors and spans in the results of a prediction."""

from __future__ import annotations

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import laspy
import line_pictures
import numpy as np
import pyogrio
import pytest
import shapely
from fixtures import scenes

from scenenet.clearance.settings import ClearanceSettings, SpanSag
from scenenet.detection.settings import DetectionSettings
from scenenet.line.notes import FOUND_AGAIN, NOTE_KINDS, PASSED, UNTRACED
from scenenet.line.records import AS_FLOWN
from scenenet.pointcloud import read
from scenenet.prediction.found_line import FoundLine, WireSearch, find_line_in_survey
from scenenet.prediction.found_towers import TowerSearch, find_in_survey
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_prediction import SurveyPrediction
from scenenet.prediction.writers import predict_to_files

LONE_POLES = DetectionSettings(min_conductor=0)


@pytest.fixture(scope="module")
def line(line_with_wires) -> Path:
    return line_with_wires


@pytest.fixture(scope="module")
def predicted(line_results) -> PredictionFiles:
    return line_results


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def searches(whole: SurveyPrediction) -> tuple[WireSearch, TowerSearch]:
    """What wires and towers of a prediction are looked for in."""
    [wires] = whole.further
    tau = whole.card.threshold()
    return (
        WireSearch(wires.spool, wires.tiles, wires.used.card.threshold()),
        TowerSearch(whole.spool, whole.tiles, whole.unit_sizes, tau, LONE_POLES),
    )


def test_the_conductor_is_traced_from_pole_to_pole_and_beyond(predicted):
    spans, conductors, _ = (rows(path) for path in predicted.line_tables)
    towers = {row["id"]: float(row["x"]) - scenes.PLACE[0] for row in rows(predicted.table)}
    held = [row for row in spans if row["ends"] == "between towers"]
    ends = [sorted(towers[row[end]] for end in ("from_tower", "to_tower")) for row in held]
    # The wire ends in the air, 27 m before the third pole, and leads to it.
    np.testing.assert_allclose(ends, [(30.5, 75.5), (75.5, 130.5)], atol=1.0)
    assert [float(row["length"]) for row in held] == pytest.approx([45.0, 55.0], abs=1.5)
    assert {row["line"] for row in spans} == {"1"}
    assert [row["order"] for row in spans] == ["1", "2", "3"]
    assert len(conductors) == 3
    for row in conductors:
        assert row["kind"] == "conductor"
        for tower, z in (("from_tower", "from_z"), ("to_tower", "to_z")):
            if row[tower] != "0":
                assert float(row[z]) == pytest.approx(scenes.PLACE[2] + scenes.WIRE_Z, abs=0.15)
    between = next(row for row in conductors if row["span_id"] == held[0]["span_id"])
    assert float(between["sag"]) == pytest.approx(45**2 / (8 * 900), abs=0.05)


def test_a_tower_that_was_missed_is_found_where_the_line_expects_it(line, model, wire_finder):
    with predict_survey(line, [model, wire_finder], PredictSettings(), LONE_POLES) as whole:
        search, towers = searches(whole)
        found = find_in_survey(towers)
        _, missed, _ = sorted(found.towers, key=lambda tower: tower.x)
        poor = found.without({missed.id})
        again = find_line_in_survey(search, towers, poor)
    measured = {tower.id: (tower.x, tower.y, tower.base, tower.height) for tower in found.towers}
    for tower in again.towers.towers:
        assert (tower.x, tower.y, tower.base, tower.height) == pytest.approx(measured[tower.id])
    assert len(again.towers.towers) == len(found.towers) == 3
    notes = [note for note in again.line.notes if note.what == FOUND_AGAIN]
    assert [note.tower for note in notes] == [missed.id]
    spans = {(span.from_tower, span.to_tower) for span in again.line.spans}
    assert spans == {(span.from_tower, span.to_tower) for span in whole.line.spans}
    assert FoundLine.from_json(again.to_json()).towers.towers == again.towers.towers


@pytest.mark.parametrize(
    ("beside", "height", "width"), [(0.0, 1.0, 3.0), (3.0, 0.4, 0.4)], ids=["amid", "beside"]
)
def test_a_tree_that_was_taken_for_a_tower_is_dropped_and_its_place_listed(
    line, model, wire_finder, beside, height, width
):
    """Either the conductor passes it without a bend, or its span goes on beside it."""
    with predict_survey(line, [model, wire_finder], PredictSettings(), LONE_POLES) as whole:
        search, towers = searches(whole)
        found = find_in_survey(towers)
        first, second, _ = sorted(found.towers, key=lambda tower: tower.x)
        middle = (first.x + second.x) / 2, (first.y + second.y) / 2 + beside
        tree = replace(
            first, id=7, x=middle[0], y=middle[1], width=width, height=height * first.height,
            conductor_bearings=(90.0, 270.0),
        )  # fmt: skip
        again = find_line_in_survey(search, towers, replace(found, towers=(*found.towers, tree)))
    assert {tower.id for tower in again.towers.towers} == {tower.id for tower in found.towers}
    notes = [note for note in again.line.notes if note.what == PASSED]
    assert [(note.x, note.y, note.tower) for note in notes] == [(*middle, 0)]
    spans = {(span.from_tower, span.to_tower) for span in again.line.spans}
    assert spans == {(span.from_tower, span.to_tower) for span in whole.line.spans}


def test_a_span_without_wire_points_is_in_every_list(line, model, wire_finder, tmp_path):
    """The scanner saw no wire between the first two poles, and the wire beyond both."""
    survey = laspy.read(line)
    x = np.asarray(survey.x) - scenes.PLACE[0]
    between = (x > scenes.POLES_X[0]) & (x < scenes.POLES_X[1])
    survey.points = survey.points[~(between & (np.asarray(survey.classification) == 16))]
    path = tmp_path / "line.laz"
    survey.write(path)
    files = PredictionFiles.of(path, tmp_path / "found", line=True)
    predict_to_files(path, [model, wire_finder], files, PredictSettings(), LONE_POLES)
    poles = [row["id"] for row in sorted(rows(files.table), key=lambda row: float(row["x"]))[:2]]
    spans = rows(files.line_tables[0])
    ends = {row["span_id"] for row in spans if {row["from_tower"], row["to_tower"]} & {*poles}}
    assert {row["span_id"] for row in spans if row["ends"] == UNTRACED} == ends
    assert len(ends) == 2
    facts, _, geometry, values = pyogrio.raw.read(files.geopackage, layer="line_notes")
    notes = dict(zip(facts["fields"], values, strict=True))
    [row] = np.flatnonzero(notes["what"] == UNTRACED)
    assert {str(notes["tower"][row]), str(notes["to_tower"][row])} == {*poles}
    middle = np.mean(scenes.POLES_X[:2]) + scenes.PLACE[0], scenes.PLACE[1] + 15.5
    place = shapely.from_wkb(geometry[row])
    assert (place.x, place.y) == pytest.approx(middle, abs=1.0)
    page = files.page.read_text(encoding="utf-8")
    assert 'class="look untraced ring"' in page
    assert NOTE_KINDS[UNTRACED].of_span in page


def test_each_point_of_the_wire_has_its_span_and_no_other_point_has_one(predicted, line):
    [path] = predicted.points.values()
    points = laspy.read(path)
    on_wire = np.asarray(laspy.read(line).classification) == 16
    spans = {int(row["span_id"]) for row in rows(predicted.line_tables[0])}
    assert set(np.unique(points["span_id"]).tolist()) - {0} == spans
    np.testing.assert_array_equal(points["span_id"] > 0, points["conductor_id"] > 0)
    found = np.asarray(points["conductor_id"]) > 0
    assert found[on_wire].mean() > 0.95
    assert on_wire[found].mean() > 0.95


def test_points_of_conductors_are_wires_whatever_the_observer_says(line, model, wire_finder):
    xyz = read(line).xyz
    with predict_survey(line, [model, wire_finder], PredictSettings(), LONE_POLES) as whole:
        points = whole.look_up(xyz)
        tower, on = points.tower_id > 0, points.conductor_id > 0
        probability = points.models[1].probability
        tau = whole.further[0].used.card.threshold()
        np.testing.assert_array_equal(
            whole.taken(xyz, "wire"), (probability >= tau) | (on & ~tower)
        )
        np.testing.assert_array_equal(whole.taken(xyz, "tower"), tower)
        # An observer that says nothing.
        nothing = replace(points.models[1], probability=np.zeros_like(probability))
        unseen = replace(points, models=(points.models[0], nothing))
        np.testing.assert_array_equal(whole.points.taken(unseen, 1), on & ~tower)
    assert (on & ~tower).sum() > 100


def test_the_layers_have_the_rows_of_the_tables(predicted):
    for layer, table in zip(("spans", "conductors"), predicted.line_tables, strict=False):
        info = pyogrio.read_info(predicted.geopackage, layer=layer)
        assert info["features"] == len(rows(table))
        assert list(info["fields"]) == list(rows(table)[0])
        assert {row["positions"] for row in rows(table)} == {AS_FLOWN}
    wires = pyogrio.raw.read(predicted.geopackage, layer="conductors")
    assert wires[0]["geometry_type"] == "LineString Z"


def test_the_summary_counts_the_line_and_says_what_its_positions_are(predicted):
    line = json.loads(predicted.summary.read_text())["line"]
    assert (line["lines"], line["spans"], line["conductors"]) == (1, 3, 3)
    assert line["positions"] == AS_FLOWN


def test_the_key_of_the_map_has_only_what_is_on_it(predicted):
    page = predicted.page.read_text(encoding="utf-8")
    key = page.partition('<ul class="key">')[2].partition("</ul>")[0]
    assert "> conductor</li>" in key and "tower found</li>" in key
    fields = pyogrio.raw.read(predicted.geopackage, layer="line_notes")
    what = dict(zip(fields[0]["fields"], fields[3], strict=True))["what"]
    assert {kind for kind in NOTE_KINDS if f"> {kind}</li>" in key} == set(what)
    assert "cable of no line" not in key and "earth wire" not in key


def test_a_table_of_sags_changes_clearances_and_the_page_alone(
    predicted, line, model, wire_finder, tmp_path
):
    spans = rows(predicted.line_tables[0])
    longest = max(spans, key=lambda row: float(row["length"]))
    sag = SpanSag(span=int(longest["span_id"]), c=200, temperature=80)
    files = PredictionFiles.of(line, tmp_path, line=True)
    predict_to_files(
        line, [model, wire_finder], files, PredictSettings(), LONE_POLES,
        clearance=ClearanceSettings(sags=(sag,)),
    )  # fmt: skip
    for table, before in zip(files.line_tables[:2], predicted.line_tables, strict=False):
        assert table.read_bytes() == before.read_bytes()
    was = {row["span_id"]: float(row["ground"]) for row in rows(predicted.line_tables[2])}
    for row in rows(files.line_tables[2]):
        modelled = row["span_id"] == longest["span_id"]
        assert row["positions"].startswith("modelled at 80 degrees C" if modelled else "as flown")
        lower = was[row["span_id"]] - float(row["ground"])
        assert lower > 1.0 if modelled else lower == pytest.approx(0)
    assert "others modelled at 80 degrees C" in files.page.read_text(encoding="utf-8")
    assert "modelled" not in predicted.page.read_text(encoding="utf-8")


def test_the_picture_draws_each_conductor_over_the_points(predicted):
    found = line_pictures.FoundLine.of(predicted)
    plan, profile = line_pictures.draw(found).axes
    conductors = rows(predicted.line_tables[1])
    span = profile.get_title(loc="left").rpartition(" ")[2]
    own = [row["span_id"] for row in conductors].count(span)
    # Beside the wires: in plan the points, the towers and what the legend shows of a conductor.
    assert len(plan.lines) == len(conductors) + 3
    assert own > 0
    wires = [drawn for drawn in profile.lines if drawn.get_linewidth() == line_pictures.WIRE_WIDTH]
    assert len(wires) == own
    heights = np.concatenate([drawn.get_ydata() for drawn in wires])
    deepest = 55**2 / (8 * 900)
    assert (
        np.abs(heights + deepest / 2 - scenes.PLACE[2] - scenes.WIRE_Z) < deepest / 2 + 0.1
    ).all()


def test_towers_alone_leave_no_outdated_line(predicted, line, model, tmp_path):
    files = PredictionFiles.of(line, shutil.copytree(predicted.summary.parent, tmp_path / "again"))
    tables = [files.summary.with_name(path.name) for path in predicted.line_tables]
    assert all(path.exists() for path in tables)
    predict_to_files(line, model, files, PredictSettings(), LONE_POLES)
    assert not any(path.exists() for path in tables)
    assert "spans" not in pyogrio.list_layers(files.geopackage)[:, 0]
