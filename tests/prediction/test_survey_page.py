"""The page of a survey: what it says, and that it is the same for equal predictions."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.detection.settings import DetectionSettings
from scenenet.prediction.file_status import LeftOut, SurveyFile
from scenenet.prediction.page.budget import (
    MOST_BYTES,
    MOST_FILES,
    OTHER_POINTS,
    OWN_POINTS,
    PICTURE_BYTES,
    POINT_BYTES,
    SPAN_POINTS,
    PageBudget,
)
from scenenet.prediction.page.frame import MapFrame
from scenenet.prediction.page.map_shapes import MOST_CORNERS
from scenenet.prediction.page.pictures import TowerPicture, tower_pictures
from scenenet.prediction.page.survey_facts import MOST_WARNINGS, not_seen
from scenenet.prediction.page.survey_page import PageContent, survey_page
from scenenet.prediction.page.thinning import STEP_M, quotas, thinned
from scenenet.prediction.page.tower_list import LISTED
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.writers import predict_to_files

LONE_POLES = DetectionSettings(min_conductor=0)


@pytest.fixture(scope="module")
def page(line_page: Path) -> str:
    return line_page.read_text(encoding="utf-8")


def page_of(prediction, pictures: bool = False) -> str:
    """The page of a prediction, perhaps with the pictures of its towers."""
    content = PageContent.of(prediction)
    towers = [tower for tower, _ in content.towers] if pictures else []
    pictured = tower_pictures(prediction, towers, content.budget)
    return "".join(survey_page(prediction, content, pictured))


def data_of(page: str) -> dict:
    return json.loads(re.search(r'id="data">(.*?)</script>', page)[1])


def points_of(page: str, tower: int) -> np.ndarray:
    text = re.search(rf'id="points-{tower}" data-own="\d+">([^<]*)<', page)[1]
    return np.frombuffer(base64.b64decode(text), "<i2").reshape(-1, 3) * STEP_M


def test_every_tower_is_in_the_list_on_the_map_and_has_its_points(page):
    towers = data_of(page)["towers"]
    assert len(towers) == 3
    for tower in towers:
        assert page.count(f'<tr data-tower="{tower["id"]}"') == 1
        assert len(re.findall(rf'<path class="tower[^>]*data-tower="{tower["id"]}"', page)) == 1
        assert page.count(f'id="points-{tower["id"]}"') == 1
        assert tower["evidence"]


def test_the_list_has_the_columns_for_people(page):
    headings = re.findall(r'<th scope="col" class="\w+" title="[^"]+"><button[^>]*>([^<]*)', page)
    named = [re.sub(r" \[.*\]", "", heading) for heading in headings]
    assert named == ["tower", "state", *(column.heading for column in LISTED[1:])]


def test_a_tower_with_a_reason_to_doubt_it_is_to_check(page):
    found = {tower["id"]: tower["doubts"] for tower in data_of(page)["towers"]}
    checked = set(map(int, re.findall(r'<tr data-tower="(\d+)" class="check"', page)))
    assert checked == {tower for tower, doubts in found.items() if doubts}
    assert 0 < len(checked) < 3
    assert "of these to check" in page


def test_the_picture_of_a_tower_has_its_own_points_first(page):
    for tower in data_of(page)["towers"]:
        xyz = points_of(page, tower["id"])
        own = int(re.search(rf'id="points-{tower["id"]}" data-own="(\d+)"', page)[1])
        assert 100 < own < len(xyz)
        away = np.hypot(*xyz[:, :2].T)
        assert away[:own].max() < 3
        assert away.max() <= tower["radius_m"] + STEP_M
        assert xyz[:own, 2].max() == pytest.approx(tower["height_m"], abs=0.5)


def test_names_of_files_cannot_become_markup(line_with_a_broken_file, model):
    folder = line_with_a_broken_file
    with predict_survey(folder, model, PredictSettings(), LONE_POLES) as prediction:
        page = page_of(prediction, pictures=True)
        left_out = replace(prediction.files[0], error=LeftOut("another system"))
        more = page_of(replace(prediction, files=(*prediction.files, left_out)))
    assert "<img" not in page
    assert "&lt;img src=x onerror=alert(1)&gt; &amp; &#x27;quotes&quot;.laz" in page
    assert "not used: 1 of 3 files" in page
    for label, number in (("files read", 2), ("files failed", 1), ("files left out", 1)):
        assert f"<dt>{label}</dt><dd>{number}</dd>" in more


def test_equal_predictions_give_equal_pages(line, line_page, model, tmp_path):
    files = PredictionFiles.of(line, tmp_path)
    summary = predict_to_files(line, model, files, PredictSettings(), LONE_POLES)
    assert files.page.read_bytes() == line_page.read_bytes()
    assert files.page.name in summary.outputs


def test_a_survey_without_towers_has_a_page(line, model):
    with predict_survey(line, model, PredictSettings(), LONE_POLES) as prediction:
        page = page_of(replace(prediction, towers=()))
    assert data_of(page)["towers"] == []
    assert "<dt>towers</dt><dd>0</dd>" in page


def test_what_is_wrong_with_many_files_is_said_once_and_briefly(line, model):
    with predict_survey(line, model, PredictSettings(), LONE_POLES) as prediction:
        [file] = prediction.files
        files = [
            replace(file, name=f"{i}.laz", warnings=("all have it", f"only {i} has it"))
            for i in range(30)
        ]
        page = page_of(replace(prediction, files=tuple(files)))
    assert page.count("all have it (0.laz and 29 more files)") == 1
    assert page.count("has it (") == MOST_WARNINGS - 1
    assert f"{31 - MOST_WARNINGS} more warnings" in page


def test_only_its_own_script_and_style_may_run(page):
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)[1]
    assert policy.startswith("default-src 'none'")
    assert "unsafe" not in policy
    assert not re.search(r"\son\w+=", page)
    assert not re.search(r"""(src|href)=["'](?!#)""", page)


def test_what_is_not_in_the_list_follows_the_settings():
    with_conductors, without = not_seen(DetectionSettings(min_height=12)), not_seen(LONE_POLES)
    assert any("lower than 12 m" in sentence for sentence in with_conductors)
    assert any("without conductors" in sentence for sentence in with_conductors)
    assert not any("without conductors" in sentence for sentence in without)


def test_thinned_points_are_as_many_as_asked_for_and_keep_thin_parts():
    rng = np.random.default_rng(0)
    ground = np.column_stack([rng.uniform(-30, 30, (50_000, 2)), rng.normal(0, 0.02, 50_000)])
    wire = np.column_stack([np.linspace(-30, 30, 300), np.zeros(300), np.full(300, 20.0)])
    points = np.concatenate([ground, wire])
    few = thinned(points, 1800)
    assert 1000 < len(few) <= 1800
    on_wire = np.sort(few[few[:, 2] > 10][:, 0])
    assert len(on_wire) > 3 * 1800 * 300 / len(points)
    assert np.diff(on_wire).max() < 3
    np.testing.assert_array_equal(thinned(points, 1800), few)
    assert thinned(wire, 300) is wire
    assert len(thinned(np.zeros((50, 3)), 10)) == 1


def test_those_to_check_come_first(page):
    rows = re.findall(r'<tr data-tower="(\d+)" class="(\w+)"', page)
    states = [state for _, state in rows]
    assert states == sorted(states) and set(states) == {"check", "found"}
    doubts = {tower["id"]: len(tower["doubts"]) for tower in data_of(page)["towers"]}
    listed = [doubts[int(number)] for number, _ in rows]
    assert listed == sorted(listed, reverse=True)


def test_more_towers_and_spans_have_fewer_points_each():
    assert PageBudget.of(0, 0).share == PageBudget.of(500, 0).share == 1
    assert PageBudget.of(101, 100).share == 1
    for n, spans in ((1000, 0), (4000, 0), (400, 399), (20_000, 0), (20_000, 19_000)):
        of = PageBudget.of(n, spans)
        full = of.towers * (OWN_POINTS + OTHER_POINTS) + of.spans * SPAN_POINTS
        assert full * of.share * POINT_BYTES == pytest.approx(PICTURE_BYTES)
        assert of.share > 0.1


def test_what_one_kind_of_points_does_not_need_the_others_get():
    assert quotas([5, 100, 0], [0.5, 0.25, 0.25], 50) == [5, 45, 0]
    assert quotas([100, 100], [0.75, 0.25], 40) == [30, 10]
    assert quotas([3, 4], [0.5, 0.5], 40) == [3, 4]
    assert quotas([0, 0], [0.5, 0.5], 40) == [0, 0]


def test_the_page_of_a_large_survey_is_bounded_and_says_what_it_leaves_out(line, model):
    n = 6000
    with predict_survey(line, model, PredictSettings(), LONE_POLES) as prediction:
        first = prediction.towers[0]
        [file] = prediction.files
        large = replace(
            prediction,
            towers=tuple(replace(first, id=i + 1, x=first.x + 40 * i) for i in range(n)),
            files=tuple(replace(file, name=f"{i}.laz") for i in range(n)),
        )
        content = PageContent.of(large)
        points = content.budget.points(OWN_POINTS + OTHER_POINTS)
        steps = np.full((points, 3), 12_345, "<i2")
        drawn = (TowerPicture(tower.id, steps, 10) for tower, _ in content.towers)
        page = "".join(survey_page(large, content, drawn))
    listed = page.count("<tr data-tower=")
    assert 3000 < listed < n
    assert len(data_of(page)["towers"]) == page.count('id="points-') == listed
    assert 0.7 * MOST_BYTES < len(page.encode()) < MOST_BYTES
    assert f"the first {listed:,} of {n:,} towers".replace(",", "\u202f") in page
    assert "pictures have fewer points" in page
    assert page.count('<path class="file') == MOST_FILES
    assert f"{n - MOST_FILES:,} more files".replace(",", "\u202f") in page


def test_the_frame_of_a_map_is_in_whole_units_around_everything():
    nothing = (np.nan,) * 4
    frame = MapFrame.around([(10.2, 20.2, 30.4, 25.0), nothing, (12.0, 18.9, 12.0, 18.9)])
    assert frame == MapFrame(10.0, 25.0, 21.0, 7.0)
    assert frame.place(12.0, 18.9) == "2.00 6.10"
    assert MapFrame.around([nothing]).width > 0


def test_a_file_without_points_is_not_on_the_map(line, model):
    with predict_survey(line, model, PredictSettings(), LONE_POLES) as prediction:
        empty = SurveyFile(Path("e.laz"), "e.laz", error=InputError("broken", file="e.laz"))
        page = page_of(replace(prediction, files=(*prediction.files, empty)))
    assert page.count('<path class="file') == 1
    assert "e.laz: broken" in page
    outline = re.search(r'<path class="coverage" d="([^"]*)"', page)[1]
    assert 4 <= outline.count("L") < MOST_CORNERS
