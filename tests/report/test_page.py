"""The report is one page that opens offline and says what the result files say."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from scenenet.errors import InputError
from scenenet.figures import draw_all, plan
from scenenet.metrics import ThresholdCurve
from scenenet.published import Thesis
from scenenet.report import write_report
from scenenet.report.blocks import NOTHING, write
from scenenet.results import Results
from scenenet.scenes3d import write_scene
from scenenet.studies.run import COLUMNS
from scenenet.studies.settings import StudySettings
from scenenet.tables import write_tables

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
VOID = {"meta", "img", "br", "hr", "link"}


class Page(HTMLParser):
    """Elements of a page, and whether every one was closed in order."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.open: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture
def page(results: Results, thesis: Thesis, tmp_path: Path) -> Path:
    write_tables(results, thesis, results.folder / "tables")
    chosen = ("training-scenenet", "precision-recall", "prediction-fresh")
    draw_all([d for d in plan(results, thesis) if d.name in chosen], results.folder / "figures")
    out = tmp_path / "report" / "index.html"
    write_report(results, thesis, out)
    return out


def read(path: Path) -> Page:
    return Page(path.read_text(encoding="utf-8"))


def test_the_page_is_whole_html(page: Path):
    assert read(page).open == []


def test_the_page_asks_for_nothing_but_itself(page: Path):
    html = page.read_text(encoding="utf-8")
    assert not re.search(r"""(src|href)=["'](?!#|data:)""", html)
    assert "url(" not in html
    assert "@import" not in html


def test_every_picture_is_in_the_page_with_words_for_it(page: Path):
    images = read(page).all("img")
    assert len(images) == 3
    for image in images:
        assert image["src"].startswith("data:image/png;base64,")
        assert len(image["alt"]) > 40
        assert int(image["width"]) > 300


def test_the_contents_lead_to_every_section(page: Path):
    found = read(page)
    leads = [a["href"] for a in found.all("a") if a["href"] != "#content"]
    assert leads == ["#" + section["id"] for section in found.all("section")]
    assert "#predictions" in leads


def test_our_scores_stand_beside_those_of_the_thesis(page: Path):
    text = read(page).text
    assert "0.70 ± 0.14" in text  # precision of SCENE-Net: 0.8 and 0.6
    assert "0.68 ± 0.08" in text  # Table 5.3
    assert "nothing detected" in text


def test_a_study_is_asked_shown_and_told(page: Path, results: Results, thesis: Thesis):
    study = StudySettings(
        name="ablations", title="Which operators?", place="Table 5.5", asks="What does it need?",
        seeds=(0, 1), variants=({"name": "E", "thesis": "ablation.e"}, {"name": "A"}),
        thesis_says="one of each is best.",
    )  # fmt: skip
    rows = [dict.fromkeys(COLUMNS, 0.5) | {"variant": v, "seed": s, "precision": 0.3 + s / 10}
            for v in "EA" for s in (0, 1)]  # fmt: skip
    folder = results.folder / "studies" / "ablations"
    folder.mkdir(parents=True)
    pd.DataFrame(rows).to_csv(folder / "runs.csv", index=False)
    studied = replace(results, studies=[study])
    write_tables(studied, thesis, results.folder / "tables")
    drawn = [drawing for drawing in plan(studied, thesis) if drawing.section == "studies"]
    draw_all(drawn, results.folder / "figures")
    write_report(studied, thesis, page)
    found = read(page)
    assert "studies" in [section["id"] for section in found.all("section")]
    shown = ["Which operators?", "What does it need?", "0.35 ± 0.07", "0.68"]
    concluded = ["Best here: E with an F0.5 of 0.50", "The thesis: one of each is best."]
    for said in shown + concluded:
        assert said in found.text
    assert any("E: precision 0.35" in (image["alt"] or "") for image in found.all("img"))


def test_towers_of_a_classified_survey_are_listed_with_reasons(page: Path):
    text = read(page).text
    for said in ("512000.00", "20.10", "0.930", "negative sphere [%]", "-10.0"):
        assert said in text


def test_what_comes_from_files_cannot_become_markup(page: Path):
    html = page.read_text(encoding="utf-8")
    assert "no &lt;CRS&gt; is named" in html
    assert "<CRS>" not in html


def test_provenance_names_config_and_code_of_each_training(page: Path):
    text = read(page).text
    assert "train/scenenet/seed-1/provenance.json" in text
    assert "c0f19" in text


def test_the_same_results_give_the_same_page(page: Path, results: Results, thesis: Thesis):
    before = page.read_bytes()
    for later in ("report", "mlflow"):
        (results.folder / later).mkdir()
        (results.folder / later / "provenance.json").write_text('{"stage": "later"}')
    write_report(results, thesis, page)
    assert page.read_bytes() == before


def test_sections_without_results_are_left_out(thesis: Thesis, tmp_path: Path):
    empty = Results(tmp_path, {"scenenet": "scenenet"}, seeds=[0])
    write_report(empty, thesis, tmp_path / "index.html")
    sections = [section["id"] for section in read(tmp_path / "index.html").all("section")]
    assert sections == ["overview", "provenance"]
    assert "No model has been evaluated" in read(tmp_path / "index.html").text


def test_a_survey_without_towers_says_so(page: Path, results: Results, thesis: Thesis):
    file = results.folder / "predict" / "fresh" / "fresh.towers.geojson"
    file.write_text('{"type": "FeatureCollection", "features": []}')
    write_report(results, thesis, page)
    assert "No tower was found in fresh." in read(page).text


def test_a_picture_that_is_none_is_named(page: Path, results: Results, thesis: Thesis):
    (results.folder / "figures" / "training-scenenet.png").write_text("not a picture")
    with pytest.raises(InputError, match=r"training-scenenet\.png: is not a PNG"):
        write_report(results, thesis, page)


@pytest.mark.parametrize(
    ("value", "how", "text"),
    [
        (None, "score", NOTHING),
        (float("nan"), "count", NOTHING),
        (1234567, "count", "1\u202f234\u202f567"),
        (0.0164, "seconds", "16.4 ms"),
        (5100, "seconds", "1.4 h"),
        (0, "percent", "0"),
        (44.752, "percent", "44.752"),
        (34.74, "number", "34.74"),
        (300.0, "number", "300"),
        (True, "yes", "yes"),
    ],
)
def test_values_are_written_as_people_read_them(value, how, text):
    assert write(value, how) == text


def browse(page: Path, tmp_path: Path) -> str:
    """The document as Chromium has it after five seconds, without a network."""
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
               "--disable-background-networking", "--disable-component-update", "--disable-sync",
               f"--user-data-dir={tmp_path / 'browser'}", "--virtual-time-budget=5000",
               "--dump-dom", page.as_uri()]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout


ACT = """<script>
addEventListener("error", (event) => { document.body.dataset.error = event.message; });
addEventListener("load", () => {
  const told = document.body.dataset;
  const canvas = document.querySelector("figure.scene canvas");
  const ink = () => {
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let sum = 0;
    for (let i = 3; i < pixels.length; i += 4) sum += pixels[i] > 0;
    return sum;
  };
  const picture = () => canvas.toDataURL();
  told.ink = ink();
  const slider = document.querySelector("figure.scene input");
  const said = document.querySelector("figure.scene output");
  const move = (to) => { slider.value = to; slider.dispatchEvent(new Event("input")); };
  move(0); told.low = said.textContent;
  move(120); told.high = said.textContent;
  const before = picture();
  canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
  told.turned = picture() !== before;
  const select = document.querySelector("figure.scene select");
  told.colours = [...select.options].map((option) => option.value);
  told.drawn = [...select.options].map((option) => {
    select.value = option.value;
    select.dispatchEvent(new Event("change"));
    return picture();
  }).filter((one, i, all) => all.indexOf(one) === i).length;
  const table = [...document.querySelectorAll("table")]
    .find((one) => one.textContent.includes("best on validation"));
  const heads = [...table.querySelectorAll("thead button")];
  const column = heads.findIndex((head) => head.textContent === "recall");
  const rows = table.tBodies[0].rows;
  const read = () => [...rows].map((row) => parseFloat(row.cells[column].textContent));
  const press = () => heads[column].click();
  press(); told.rising = read();
  press(); told.falling = read();
});
</script></body>"""


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")
def test_a_crop_turns_tau_moves_the_scores_and_tables_sort(
    page: Path, results: Results, thesis: Thesis, tmp_path: Path
):
    scene = write_scene(results, "scenenet", "best", results.folder / "scenes" / "best.json")
    write_report(results, thesis, page)
    html = page.read_text(encoding="utf-8")
    page.write_text(html.replace("</body>", ACT), encoding="utf-8")
    dom = browse(page, tmp_path)
    told = dict(re.findall(r'data-(\w+)="([^"]*)"', dom[dom.index("<body") :].partition(">")[0]))
    assert "error" not in told
    assert int(told["ink"]) > 1000
    assert told["turned"] == "true"
    assert told["colours"].split(",")[:3] == ["found", "class", "probability"]
    assert int(told["drawn"]) == len(told["colours"].split(","))
    curve = ThresholdCurve(np.array(scene["true"]), np.array(scene["false"]))
    for name, step in (("low", 0), ("high", 120)):
        counts = curve.confusion(step)
        assert f"precision {counts.precision:.3f}, recall {counts.recall:.3f}" in told[name]
    rising = [float(x) for x in told["rising"].split(",")]
    assert rising == sorted(rising)
    assert [float(x) for x in told["falling"].split(",")] == sorted(rising, reverse=True)
    assert len(set(rising)) > 1


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")
def test_a_phone_shows_the_page_without_scrolling_sideways(page: Path, tmp_path: Path):
    # The frame is as wide as a phone; the page in it says how wide it came out.
    measure = (
        "<script>const page = document.documentElement;"
        "parent.postMessage([page.scrollWidth, page.clientWidth, innerWidth], '*')</script></body>"
    )
    inner = page.read_text(encoding="utf-8").replace("</body>", measure)
    (tmp_path / "inner.html").write_text(inner, encoding="utf-8")
    outer = tmp_path / "outer.html"
    outer.write_text(
        "<body><script>addEventListener('message', e => document.body.dataset.widths = e.data)"
        "</script><iframe src='inner.html' style='width:390px;height:800px;border:0'></iframe>"
    )
    dom = browse(outer, tmp_path)
    widths = re.search(r'data-widths="(\d+),(\d+),(\d+)"', dom)
    assert widths, dom[-2000:]
    content, room, screen = map(int, widths.groups())
    assert (content, screen) == (room, 390)
