"""The page of a survey in Chromium: map, list and pictures are one, with mouse and keyboard."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from fixtures.browser import CONTRASTS, INK, opened

from scenenet.detection.settings import DetectionSettings
from scenenet.prediction.page.pictures import tower_pictures
from scenenet.prediction.page.survey_page import PageContent, survey_page
from scenenet.prediction.predict import predict_survey
from scenenet.prediction.settings import PredictSettings

VIEWS = ("view-plan", "view-along", "view-across")
MANY, MOST_BYTES, LONGEST_S = 500, 20_000_000, 2.0
SELECTED = "#towers tr[aria-current]"


def selected(tab) -> int:
    """The tower that is selected in the list, which must be that of the pictures."""
    rows = tab.locator(SELECTED)
    assert rows.count() == 1
    number = int(rows.first.get_attribute("data-tower"))
    assert tab.locator("#detail-title").inner_text() == f"Tower {number}"
    assert tab.locator("#over text").first.text_content() == str(number)
    return number


def listed(tab) -> list[int]:
    """The towers in the list, from the top."""
    rows = tab.locator("#towers tbody tr:visible")
    return [int(number) for number in rows.evaluate_all("rows => rows.map(r => r.dataset.tower)")]


def drawn(tab) -> list[str]:
    return [tab.locator(f"#{view}").evaluate("canvas => canvas.toDataURL()") for view in VIEWS]


def middle(tab, number: int) -> tuple[float, float]:
    box = tab.locator(f'#world [data-tower="{number}"]').evaluate(
        "mark => { const b = mark.getBoundingClientRect(); return [b.x + b.width / 2, "
        "b.y + b.height / 2]; }"
    )
    return box[0], box[1]


def test_the_first_tower_is_shown_in_three_views(pictures, line_page):
    with opened(pictures, line_page, width=1400) as tab:
        assert selected(tab) == listed(tab)[0]
        assert all(tab.locator(f"#{view}").evaluate(INK) > 300 for view in VIEWS)
        assert len(set(drawn(tab))) == 3
        assert "conductors" in tab.locator("#evidence").inner_text()
        assert tab.locator("#shares tr").count() == 3


def test_a_click_in_the_list_and_on_the_map_select_a_tower(pictures, line_page):
    with opened(pictures, line_page, width=1400) as tab:
        _, second, third = listed(tab)
        before = drawn(tab)
        tab.locator(f'#towers [data-tower="{second}"] td').nth(1).click()
        assert selected(tab) == second
        assert all(a != b for a, b in zip(before, drawn(tab), strict=True))
        tab.mouse.click(*middle(tab, third))
        assert selected(tab) == third
        assert tab.evaluate("location.hash") == f"#tower-{third}"


def test_arrow_keys_go_from_tower_to_tower(pictures, line_page):
    with opened(pictures, line_page, width=1400) as tab:
        order = listed(tab)
        tab.locator(f"{SELECTED} button").focus()
        for key, at in (
            ("ArrowDown", 1),
            ("End", 2),
            ("ArrowDown", 2),
            ("ArrowUp", 1),
            ("Home", 0),
        ):
            tab.keyboard.press(key)
            assert selected(tab) == order[at]
            assert tab.evaluate("document.activeElement.textContent") == str(order[at])
        places = tab.evaluate("data.towers.map(t => [t.x, t.id]).sort((a, b) => a[0] - b[0])")
        west, between, east = (number for _, number in places)
        tab.locator(f'#towers [data-tower="{between}"] button').click()
        tab.locator("#plan").focus()
        for key, expected in (
            ("ArrowLeft", west), ("ArrowRight", between), ("ArrowRight", east),
            ("ArrowRight", east), ("ArrowLeft", between),
        ):  # fmt: skip
            tab.keyboard.press(key)
            assert selected(tab) == expected


def test_an_address_with_a_tower_opens_it(pictures, line_page):
    with opened(pictures, line_page, width=1400) as tab:
        last = listed(tab)[-1]
        tab.goto(f"{line_page.as_uri()}#tower-{last}")
        tab.wait_for_function(f"chosen === {last}")
        assert selected(tab) == last


def test_the_list_sorts_and_filters(pictures, line_page):
    with opened(pictures, line_page, width=1400) as tab:
        heads = tab.locator("#towers thead button")
        labels = heads.all_inner_texts()
        for column in (labels.index("x [m]"), labels.index("probability")):
            cells = tab.locator(f"#towers tbody tr > :nth-child({column + 1})")
            heads.nth(column).click()
            rising = [float(text) for text in cells.all_inner_texts()]
            assert rising == sorted(rising)
            heads.nth(column).press("Enter")
            falling = [float(text) for text in cells.all_inner_texts()]
            assert falling == rising[::-1]
        everything = listed(tab)
        tab.locator("#state").select_option("check")
        to_check = listed(tab)
        assert 0 < len(to_check) < 3
        assert tab.locator("#shown").inner_text() == f"{len(to_check)} of 3 shown"
        assert tab.locator("#world .tower.off").count() == 3 - len(to_check)
        tab.locator("#state").select_option("")
        tab.locator("#filter").fill(str(everything[1]))
        assert listed(tab) == [everything[1]]
        tab.locator("#filter").fill("nothing like this")
        assert listed(tab) == []


def test_the_map_zooms_and_moves_and_says_its_scale(pictures, line_page):
    with opened(pictures, line_page, width=1400) as tab:
        rounded = tab.evaluate("[1, 9.99, 700, 999.9999999999999, 0.05].map(round)")
        assert rounded == pytest.approx([1, 5, 500, 500, 0.05])
        scale = "plan.scale"
        whole = tab.evaluate(scale)
        tab.locator("#zoom-in").click()
        assert tab.evaluate(scale) == pytest.approx(1.5 * whole)
        box = tab.locator("#plan").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        first = listed(tab)[0]
        before = middle(tab, first)
        chosen = selected(tab)
        tab.mouse.move(x, y)
        assert "x 5000" in tab.locator("#pointer").inner_text()
        tab.mouse.down()
        tab.mouse.move(x + 60, y + 20, steps=4)
        tab.mouse.up()
        after = middle(tab, first)
        assert after == pytest.approx((before[0] + 60, before[1] + 20), abs=1)
        assert selected(tab) == chosen
        tab.mouse.wheel(0, -400)
        assert tab.evaluate(scale) > 2 * whole
        bar = tab.locator("#over .bar").evaluate("bar => bar.getBBox().width")
        text = tab.locator("#over text", has_text=" m").text_content()
        assert bar == pytest.approx(float(text.split()[0]) * tab.evaluate(scale), rel=0.01)
        tab.locator("#zoom-all").click()
        assert tab.evaluate(scale) == pytest.approx(whole)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_contrast(pictures, line_page, scheme):
    with opened(pictures, line_page, scheme=scheme, width=1400) as tab:
        for details in tab.locator("summary").all():
            details.click()
        contrasts = tab.evaluate(CONTRASTS)
        assert {"h1", "h2", "p", "td", "figcaption"} <= set(contrasts)
        assert min(contrasts.values()) >= 4.5, contrasts


@pytest.mark.parametrize("width", [390, 600, 1400])
def test_the_page_does_not_scroll_sideways(pictures, line_page, width):
    with opened(pictures, line_page, width=width, height=800) as tab:
        content, room = tab.evaluate(
            "[document.documentElement.scrollWidth, document.documentElement.clientWidth]"
        )
        assert content == room == width


@pytest.fixture(scope="module")
def many(line, model, tmp_path_factory) -> Path:
    """A page with as many towers: those of ``line`` again and again, each with full pictures."""
    path = tmp_path_factory.mktemp("many") / "many.html"
    settings, detection = PredictSettings(), DetectionSettings(min_conductor=0)
    with predict_survey(line, model, settings, detection) as prediction:
        full = PageContent.of(prediction)
        drawn = list(tower_pictures(prediction, prediction.towers, full.budget))
        towers = [
            replace(prediction.towers[i % 3], id=i + 1, x=prediction.towers[i % 3].x + 40 * i)
            for i in range(MANY)
        ]
        many = replace(prediction, towers=tuple(towers))
        content = PageContent.of(many)
        again = (replace(drawn[(t.id - 1) % 3], tower=t.id) for t, _ in content.towers)
        path.write_text("".join(survey_page(many, content, again)), "utf-8")
    return path


def test_many_towers_open_at_once(pictures, many):
    assert 5_000_000 < many.stat().st_size < MOST_BYTES
    with pictures.browsing(width=1400) as tab:
        session = tab.context.new_cdp_session(tab)
        session.send("Performance.enable", {"timeDomain": "threadTicks"})
        tab.goto(many.as_uri())
        measured = {
            one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]
        }
        # The time of its thread, not of the clock: other tests share the machine.
        assert measured["TaskDuration"] < LONGEST_S
        order = listed(tab)
        assert sorted(order) == list(range(1, MANY + 1))
        assert selected(tab) == order[0]
        tab.locator(f"{SELECTED} button").press("End")
        assert selected(tab) == order[-1]
