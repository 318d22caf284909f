"""The page in Chromium: light and dark, wide and narrow, without a network."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fixtures.browser import CONTRASTS, INK, opened

from scenenet.experiments.published import Thesis
from scenenet.figures.interactive_crop import write_interactive_crop
from scenenet.metrics.threshold_curve import ThresholdCurve
from scenenet.report import write_report
from scenenet.results.folder import Results
from scenenet.results.interactive_crop import InteractiveCrop

SCHEMES = pytest.mark.parametrize("scheme", ["light", "dark"])
PHONE_PX = 390


@pytest.fixture
def scene(page: Path, results: Results, thesis: Thesis) -> InteractiveCrop:
    """The interactive crop of the page."""
    made = write_interactive_crop(
        results, "scenenet", "best", results.folder / "interactive_crop" / "best.json"
    )
    write_report(results, thesis, page)
    return made


@SCHEMES
def test_every_interactive_crop_is_drawn_and_rotates_with_the_mouse(pictures, page, scene, scheme):
    with opened(pictures, page, scheme=scheme) as tab:
        canvases = tab.locator("figure.scene canvas")
        assert canvases.count() == 1
        canvas = canvases.first
        canvas.scroll_into_view_if_needed()
        assert canvas.evaluate(INK) > 1000
        before = canvas.evaluate("canvas => canvas.toDataURL()")
        box = canvas.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        tab.mouse.move(x, y)
        assert canvas.evaluate("canvas => canvas.toDataURL()") == before, (
            "it turns only when dragged"
        )
        tab.mouse.down()
        tab.mouse.move(x + 80, y + 10, steps=4)
        tab.mouse.up()
        turned = canvas.evaluate("canvas => canvas.toDataURL()")
        assert turned != before
        canvas.focus()
        tab.keyboard.press("ArrowLeft")
        assert canvas.evaluate("canvas => canvas.toDataURL()") != turned


def test_the_slider_moves_tau_and_the_scores_are_those_of_the_curve(pictures, page, scene):
    curve = ThresholdCurve(np.array(scene.true), np.array(scene.false))
    with opened(pictures, page) as tab:
        slider, scores = (tab.locator(f"figure.scene {one}") for one in ("input", "output"))
        slider.scroll_into_view_if_needed()
        box = slider.bounding_box()
        middle = box["y"] + box["height"] / 2
        seen = []
        for share in (0.02, 0.5, 0.9):
            tab.mouse.move(box["x"] + box["width"] * 0.5, middle)
            tab.mouse.down()
            tab.mouse.move(box["x"] + box["width"] * share, middle, steps=5)
            tab.mouse.up()
            step = int(slider.input_value())
            counts = curve.confusion(step)
            assert f"precision {counts.precision:.3f}, recall {counts.recall:.3f}" in (
                scores.inner_text()
            )
            seen.append(step)
        assert seen == sorted(set(seen))


def test_each_colouring_is_another_picture(pictures, page, scene):
    with opened(pictures, page) as tab:
        select, canvas = (tab.locator(f"figure.scene {one}") for one in ("select", "canvas"))
        colours = select.evaluate("select => [...select.options].map(option => option.value)")
        assert colours[:4] == ["found", "whole", "class", "probability"]
        drawn = set()
        for colour in colours:
            select.select_option(colour)
            drawn.add(canvas.evaluate("canvas => canvas.toDataURL()"))
        assert len(drawn) == len(colours)


def test_a_table_sorts_by_the_clicked_heading(pictures, page):
    with opened(pictures, page) as tab:
        table = tab.locator("table", has_text="best on validation").first
        heads = table.locator("thead button")
        column = heads.all_inner_texts().index("recall")
        cells = table.locator(f"tbody tr td:nth-child({column + 1})")
        heads.nth(column).click()
        rising = [float(text.split()[0]) for text in cells.all_inner_texts()]
        assert rising == sorted(rising)
        assert len(set(rising)) > 1
        heads.nth(column).press("Enter")
        falling = [float(text.split()[0]) for text in cells.all_inner_texts()]
        assert falling == sorted(rising, reverse=True)


@SCHEMES
def test_text_has_contrast_in_the_light_and_the_dark_scheme(pictures, page, scheme):
    with opened(pictures, page, scheme=scheme) as tab:
        contrasts = tab.evaluate(CONTRASTS)
        assert {"h1", "h2", "p", "td", "figcaption", "a"} <= set(contrasts)
        assert min(contrasts.values()) >= 4.5, contrasts
        paper = tab.evaluate("getComputedStyle(document.body).backgroundColor")
        shade = sum(int(part) for part in paper[4:-1].split(",")) / (3 * 255)
        assert shade > 0.9 if scheme == "light" else shade < 0.15


@pytest.mark.parametrize("width", [PHONE_PX, 768, 1200])
def test_the_page_does_not_scroll_sideways(pictures, page, scene, width):
    with opened(pictures, page, width=width, height=800) as tab:
        content, room = tab.evaluate(
            "[document.documentElement.scrollWidth, document.documentElement.clientWidth]"
        )
        assert content == room == width
