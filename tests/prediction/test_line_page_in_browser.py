"""The spans on the page of a survey, in Chromium: map, list, profile and keys."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from fixtures.browser import CONTRASTS, INK, opened

from scenenet.clearance.records import SurveyClearances
from scenenet.clearance.settings import ClearanceSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.line.frame import SpanFrame
from scenenet.line.notes import EXPECTED, LineNote
from scenenet.line.records import SurveyLine
from scenenet.prediction.page.pictures import tower_pictures
from scenenet.prediction.page.span_pictures import PICTURED, span_pictures
from scenenet.prediction.page.survey_page import PageContent, survey_page, write_page
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_prediction import SurveyPrediction

MANY, MOST_BYTES, APART_M = 100, 20_000_000, 60.0
SELECTED = "#spans tr[aria-current]"


@dataclass(frozen=True)
class Pages:
    """Pages of surveys with a line.

    Attributes:
        few: of three poles, as ``scenenet predict`` writes it.
        line, clearances: what was found there.
        many: of as many spans and towers, those of the three poles again and again.
    """

    few: Path
    line: SurveyLine
    clearances: SurveyClearances
    many: Path


@pytest.fixture(scope="module")
def pages(line_with_wires, model, wire_finder, tmp_path_factory) -> Pages:
    folder = tmp_path_factory.mktemp("line-pages")
    few, many = folder / "few.html", folder / "many.html"
    with predict_survey(
        line_with_wires, [model, wire_finder], PredictSettings(),
        DetectionSettings(min_conductor=0), clearance=ClearanceSettings(voltage=66),
    ) as prediction:  # fmt: skip
        write_page(prediction, few)
        write_many(prediction, many)
        assert prediction.line is not None and prediction.clearances is not None
        return Pages(few, prediction.line, prediction.clearances, many)


def write_many(prediction: SurveyPrediction, path: Path) -> None:
    """Write the page of ``MANY`` spans in a row."""
    line, found = prediction.line, prediction.clearances
    held = next(span for span in line.spans if span.ends == "between towers")
    budget = PageContent.of(prediction).budget
    [drawn] = span_pictures(prediction, [held], budget)
    [tower] = tower_pictures(prediction, prediction.towers[:1], budget)
    towers, spans, wires, rows, places = [], [], [], [], []
    for n in range(MANY + 1):
        first = prediction.towers[0]
        towers.append(replace(first, id=n + 1, x=first.x + APART_M * n))
    for n in range(MANY):
        x, y = towers[n].x, towers[n].y
        spans.append(
            replace(
                held, span_id=1000 + n, order=n + 1, from_tower=n + 1, to_tower=n + 2,
                start=(x, y), end=(x + APART_M, y), length=APART_M,
            )
        )  # fmt: skip
        for wire in line.conductors:
            if wire.span_id == held.span_id:
                moved = wire.catenary
                shift = x - held.start[0], y - held.start[1], 0.0
                ends = (tuple(np.add(end, shift).tolist()) for end in (moved.start, moved.end))
                start, end = ends
                curve = replace(moved, start=start, end=end)
                wires.append(replace(wire, span_id=1000 + n, catenary=curve))
        own = [place for place in found.places if place.span_id == held.span_id]
        places += [replace(place, span_id=1000 + n, x=place.x + x - held.start[0]) for place in own]
        [row] = [row for row in found.spans if row.span_id == held.span_id]
        rows.append(replace(row, span_id=1000 + n, order=n + 1))
    spans[40] = replace(spans[40], ends=EXPECTED)
    notes = (LineNote(*spans[40].start, EXPECTED, 0, spans[40].span_id),)
    large = replace(
        prediction, towers=tuple(towers), line=SurveyLine(tuple(spans), tuple(wires), notes),
        clearances=replace(found, places=tuple(places), trees=(), spans=tuple(rows), profile=()),
    )  # fmt: skip
    content = PageContent.of(large)
    assert content.budget.share == 1
    parts = survey_page(
        large, content, (replace(tower, tower=t.id) for t, _ in content.towers),
        (replace(drawn, span_id=one.span.span_id) for one in content.spans),
    )  # fmt: skip
    path.write_text("".join(parts), "utf-8")


def selected(tab) -> int:
    """The span that is selected in the list, which must be that of the profile."""
    rows = tab.locator(SELECTED)
    assert rows.count() == 1
    number = int(rows.first.get_attribute("data-span"))
    assert tab.locator("#span-title").inner_text() == f"Span {number}"
    assert f"Profile of span {number}:" in tab.locator("#profile").get_attribute("aria-label")
    return number


def listed(tab) -> list[int]:
    rows = tab.locator("#spans tbody tr:visible")
    return [int(number) for number in rows.evaluate_all("rows => rows.map(r => r.dataset.span)")]


def picture(tab) -> str:
    return tab.locator("#profile").evaluate("canvas => canvas.toDataURL()")


@pytest.fixture
def tab(pictures, pages) -> Iterator:
    """The page of three poles."""
    with opened(pictures, pages.few, width=1400, height=1250) as page:
        yield page


def test_the_worst_span_is_shown_with_its_conductors(tab, pages):
    assert listed(tab) == [row.span_id for row in pages.clearances.spans]
    assert selected(tab) == pages.clearances.spans[0].span_id
    assert tab.locator("#profile").evaluate(INK) > 3000
    assert tab.locator("#section").evaluate(INK) > 200
    assert "as flown" in tab.locator("#profile-part figcaption").inner_text().lower()
    own = [w for w in pages.line.conductors if w.span_id == selected(tab)]
    assert tab.locator("#wires tbody tr").count() == len(own) > 0


def test_the_script_draws_the_catenaries_that_were_found(tab, pages):
    shares = [0.0, 0.2, 0.5, 0.9, 1.0]
    for span in pages.line.spans:
        frame = SpanFrame.between(np.array(span.start), np.array(span.end))
        drawn = tab.evaluate(
            "([id, shares]) => spans.get(id).wires.map(w => shares.map(u => wireAt(w, u)))",
            [span.span_id, shares],
        )
        own = [w for w in pages.line.conductors if w.span_id == span.span_id]
        assert len(drawn) == len(own)
        for wire, places in zip(own, drawn, strict=True):
            expected = frame.to_frame(wire.catenary.at_shares(np.array(shares)))
            np.testing.assert_allclose(places, expected, atol=0.03)


PIXELS = """id => {
  const span = spans.get(id), canvas = byId("profile"), ratio = window.devicePixelRatio || 1;
  const context = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
  const colours = wireColours(span, (name) => style.getPropertyValue(`--${name}`).trim());
  return span.wires.map((wire, number) => {
    const [s, , z] = wireAt(wire, 0.3);
    const [x, y] = [ruler.view.x(s), ruler.view.y(z)].map((at) => Math.round(ratio * at));
    return [colours[number].match(/\\d+/g).map(Number), [...context.getImageData(x, y, 1, 1).data]];
  });
}"""
"""Of each wire its colour, and the pixel where it is drawn."""


def test_the_conductors_are_drawn_where_they_are(tab):
    drawn = tab.evaluate(PIXELS, selected(tab))
    assert drawn
    for colour, (*pixel, opacity) in drawn:
        assert opacity > 200
        np.testing.assert_allclose(pixel, colour, atol=12)


def test_points_of_each_kind_are_in_the_picture(tab, pages):
    counts = tab.evaluate(
        "id => [...pointsAlong(spans.get(id)).of].map(([k, [a, b]]) => [k, b - a])", selected(tab)
    )
    assert [kind for kind, _ in counts] == list(PICTURED)
    found = dict(counts)
    assert min(found["ground"], found["wire"], found["tower"]) > 50
    z = tab.evaluate("id => [...pointsAlong(spans.get(id)).z]", selected(tab))
    assert 99 < min(z) < 101


def test_keys_go_through_all_spans(tab, pages):
    order = listed(tab)
    seen = {picture(tab)}
    tab.locator(f"{SELECTED} button").focus()
    for number in order[1:]:
        tab.keyboard.press("ArrowDown")
        assert selected(tab) == number
        seen.add(picture(tab))
    assert len(seen) == len(order)
    along = [s.span_id for s in sorted(pages.line.spans, key=lambda s: s.order)]
    tab.evaluate("id => selectSpan(id)", along[0])
    tab.locator("#profile").focus()
    for key, at in (("ArrowRight", 1), ("ArrowRight", 2), ("ArrowRight", 2), ("ArrowLeft", 1)):
        tab.keyboard.press(key)
        assert selected(tab) == along[at]
        assert tab.evaluate("location.hash") == f"#span-{along[at]}"
    tab.locator("#plan").focus()
    tab.keyboard.press("ArrowLeft")
    assert selected(tab) == along[0]


def test_the_order_of_the_list_is_the_readers_choice(tab, pages):
    along = [s.span_id for s in sorted(pages.line.spans, key=lambda s: s.order)]
    tab.locator("#span-order").select_option("line")
    assert listed(tab) == along
    tab.locator("#span-order").select_option("check")
    doubts = tab.evaluate("ids => ids.map(id => spans.get(id).doubts.length)", listed(tab))
    assert doubts == sorted(doubts, reverse=True)
    tab.locator("#spans thead button", has_text="length").click()
    assert tab.locator("#span-order").input_value() == ""
    tab.locator("#span-order").select_option("worst")
    assert listed(tab) == [row.span_id for row in pages.clearances.spans]
    assert tab.locator("#spans [aria-sort]").count() == 0


def test_a_click_on_the_map_selects_a_span_and_a_tower(tab, pages):
    along = [s.span_id for s in sorted(pages.line.spans, key=lambda s: s.order)]
    box = tab.locator("#plan").bounding_box()
    x, y = tab.evaluate("id => plan.pixels(plan.middle(spans.get(id)))", along[1])
    tab.mouse.click(box["x"] + x, box["y"] + y)
    assert selected(tab) == along[1]
    tower = pages.line.spans[1].from_tower
    x, y = tab.evaluate("id => plan.pixels(towers.get(id))", tower)
    tab.mouse.click(box["x"] + x, box["y"] + y)
    assert tab.locator("#detail-title").inner_text() == f"Tower {tower}"
    assert not tab.locator("#profile").is_visible()
    tab.locator("#tab-towers").focus()
    tab.keyboard.press("ArrowLeft")
    assert tab.locator("#profile").is_visible()
    assert selected(tab) == along[1]


def test_what_is_too_near_is_named_with_its_limit(tab, pages):
    row = pages.clearances.spans[0]
    worst = next(p for p in pages.clearances.places if p.span_id == row.span_id)
    cells = tab.locator("#near tbody tr").first.locator("td").all_inner_texts()
    assert cells[:2] == [worst.kind, f"{worst.distance:.2f}"]
    assert float(cells[3]) == worst.limit
    assert tab.locator("#dangers").is_visible() == (row.dangers > 0)


def test_lengths_are_in_the_units_of_the_survey(pictures, pages, tmp_path):
    foot, path = 0.3048, tmp_path / "feet.html"
    metres = '"planar":"m","planar_m":1.0,"vertical":"m","vertical_m":1.0'
    page = pages.few.read_text("utf-8")
    assert metres in page
    feet = metres.replace('"m"', '"ft"').replace("1.0", str(foot))
    path.write_text(page.replace(metres, feet), "utf-8")
    row = pages.clearances.spans[0]
    span = next(span for span in pages.line.spans if span.span_id == row.span_id)
    worst = next(p for p in pages.clearances.places if p.span_id == row.span_id)
    with opened(pictures, path, width=1400) as tab:
        assert f"{span.length / foot:.1f} ft long" in tab.locator("#span-place").inner_text()
        cells = tab.locator("#near tbody tr").first.locator("td").all_inner_texts()
        assert cells[1] == f"{round(worst.distance, 2) / foot:.2f}"
        assert float(tab.locator("#cut").get_attribute("max")) == pytest.approx(
            span.length / foot, abs=0.02
        )


def test_heights_can_be_true_to_scale(tab):
    tab.locator("#heights").select_option("true")
    assert tab.evaluate("ruler.view.up === ruler.view.along")
    assert "True to scale." in tab.locator("#profile-caption").inner_text()
    tab.locator("#heights").select_option("fit")
    times = tab.evaluate("(ruler.view.up / ruler.view.along).toFixed(1)")
    assert f"{times} times" in tab.locator("#profile-caption").inner_text()


def test_the_section_moves_along_the_span(tab):
    before = tab.locator("#section").evaluate("canvas => canvas.toDataURL()")
    tab.locator("#cut").focus()
    tab.keyboard.press("Home")
    assert tab.locator("#cut-at").inner_text() == "0.0 m"
    assert tab.locator("#section").evaluate("canvas => canvas.toDataURL()") != before


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_contrast(pictures, pages, scheme):
    with opened(pictures, pages.few, scheme=scheme, width=1400) as tab:
        contrasts = tab.evaluate(CONTRASTS)
        assert min(contrasts.values()) >= 4.5, contrasts


@pytest.mark.parametrize("width", [390, 1400])
def test_the_page_does_not_scroll_sideways(pictures, pages, width):
    with opened(pictures, pages.few, width=width, height=800) as tab:
        assert tab.evaluate("document.documentElement.scrollWidth") == width


def test_a_hundred_spans_open_and_the_keyboard_goes_through_all(pictures, pages):
    assert 3_000_000 < pages.many.stat().st_size < MOST_BYTES
    with opened(pictures, pages.many, width=1400) as tab:
        order = listed(tab)
        assert sorted(order) == [1000 + n for n in range(MANY)]
        tab.locator(f"{SELECTED} button").focus()
        for number in order[1:]:
            tab.keyboard.press("ArrowDown")
            assert tab.evaluate("chosenSpan") == number
        assert selected(tab) == order[-1]
        assert tab.locator("#profile").evaluate(INK) > 3000
        tab.locator("#span-order").select_option("check")
        assert listed(tab)[0] == 1040
        tab.locator("#tab-towers").click()
        assert tab.locator("#towers tbody tr").count() == MANY + 1
