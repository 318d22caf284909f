"""The report is one page that opens offline and shows the content of the result files."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pandas as pd
import pytest
from fixtures.result_folder import with_observer, with_truth

from scenenet.clearance.records import SPAN_CLEARANCE_COLUMNS
from scenenet.core.errors import InputError
from scenenet.core.files import read_json, write_json
from scenenet.experiments.published import Thesis
from scenenet.experiments.studies.run import COLUMNS
from scenenet.experiments.studies.settings import StudySettings
from scenenet.figures import draw_all, plan
from scenenet.line.records import AS_FLOWN, SPAN_COLUMNS
from scenenet.report import write_report
from scenenet.report.blocks import NOTHING, write
from scenenet.report.sections.claims import CLAIMS
from scenenet.results.claims.claim import HOLDS, OPEN
from scenenet.results.folder import Results
from scenenet.results.score_tables import whole_towers
from scenenet.results.tables import write_tables

VOID = {"meta", "img", "br", "hr", "link"}


class Page(HTMLParser):
    """The elements of a page, and whether all are closed in order."""

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


def read(path: Path) -> Page:
    return Page(path.read_text(encoding="utf-8"))


def test_the_page_is_complete_html(page: Path):
    assert read(page).open == []


def test_the_page_needs_no_other_file(page: Path):
    html = page.read_text(encoding="utf-8")
    assert not re.search(r"""(src|href)=["'](?!#|data:)""", html)
    assert "url(" not in html
    assert "@import" not in html


def test_the_page_of_a_classified_survey_is_linked(page: Path, results: Results, thesis: Thesis):
    survey = results.folder / "predict" / "fresh" / "fresh.html"
    survey.write_text("<p>a map", encoding="utf-8")
    write_report(results, thesis, page)
    [address] = [a["href"] for a in read(page).all("a") if not a["href"].startswith("#")]
    assert (page.parent / address).resolve() == survey.resolve()


def test_every_picture_is_in_the_page_with_an_alternative_text(page: Path):
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


def test_scores_are_shown_with_those_of_the_thesis(page: Path):
    text = read(page).text
    assert "0.70 ± 0.14" in text  # precision of SCENE-Net: 0.8 and 0.6
    assert "0.68 ± 0.08" in text  # Table 5.3
    assert "nothing detected" in text


def test_the_opening_is_about_the_model_that_classifies_surveys(
    page: Path, results: Results, thesis: Thesis
):
    write_report(replace(results, predicts="cnn"), thesis, page)
    html = page.read_text(encoding="utf-8")
    opening = " ".join(html[html.index('id="overview"') :].partition("</section>")[0].split())
    assert re.search(
        r"cnn, a convolutional network with [^.]*, classifies the new "
        "surveys",
        opening,
    )
    # Precision 0.4 and 0.8, F0.5 half of that.
    assert "40% are labelled tower (precision)" in opening
    assert "seed 0, best on validation; they count the voxels at or above tau" in opening
    assert "precision 0.80, recall 0.20" in opening
    assert "F0.5 0.40, 0.20 above cnn." in opening
    write_report(results, thesis, page)
    html = page.read_text(encoding="utf-8")
    assert "F0.5 0.20, 0.20 below scenenet." in html


def test_the_opening_names_a_model_that_detects_nothing(
    results: Results, thesis: Thesis, tmp_path: Path
):
    dead = replace(results, seeds=[1])
    write_tables(dead, thesis, results.folder / "tables")
    write_report(dead, thesis, tmp_path / "index.html")
    assert "It detects no tower voxel." in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_parameters_have_sentences_and_properties_are_verified(page: Path):
    found = read(page)
    assert {"learned", "certificate"} <= {section["id"] for section in found.all("section")}
    for text in (
        "gives the strongest response",
        "76.34 %",
        "scenenet: 6 of 8 properties hold",
        "convex combination of GENEOs",
        "cnn is a convolution",
        "crop of 64³ voxels [ms]",
    ):
        assert text in found.text


def test_a_study_has_its_question_figure_table_and_findings(
    page: Path, results: Results, thesis: Thesis
):
    study = StudySettings(
        name="ablations", title="Which operators?", place="Table 5.5", asks="What does it need?",
        seeds=(0, 1), variants=({"name": "E", "thesis": "ablation.e"}, {"name": "A"}),
        thesis_says="one of each is best.",
    )  # fmt: skip
    rows = [dict.fromkeys(COLUMNS, 0.5) | {"variant": v, "seed": s, "precision": 0.3 + s / 10}
            | {"lowest_weight": -0.125 if v == "A" else 0.25}
            for v in "EA" for s in (0, 1)]  # fmt: skip
    folder = results.folder / "study" / "ablations"
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
    concluded = ["Best: E with F0.5 0.50", "Thesis: one of each is best."]
    negative = [
        "share of seeds with a negative parameter",
        "E (0 of 2 seeds), A (2 of 2 seeds)",
        "-0.125",
    ]
    for text in shown + concluded + negative:
        assert text in found.text
    assert any("E: precision 0.35" in (image["alt"] or "") for image in found.all("img"))


def test_towers_of_a_classified_survey_are_listed_with_reasons(page: Path):
    text = read(page).text
    for value in ("512000.00", "20.10", "0.930", "negative sphere [%]", "-10.0"):
        assert value in text


def test_text_from_files_is_escaped(page: Path):
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


def test_claims_open_the_page_only_where_the_run_tells_one(page, results: Results, thesis: Thesis):
    claims = results.folder / "tables" / "claims.csv"
    frame = pd.DataFrame({column.name: ["", ""] for column in CLAIMS})

    def sections(verdicts: list[str]) -> list[str]:
        frame.assign(verdict=verdicts).to_csv(claims, index=False)
        write_report(results, thesis, page)
        return [section["id"] for section in read(page).all("section")]

    assert sections([HOLDS, OPEN])[0] == "claims"
    told_none = sections([OPEN, OPEN])
    assert told_none[0] == "overview"
    assert told_none.count("claims") == 1
    assert told_none.index("claims") > told_none.index("models")
    assert "This run decides none of the 2 claims" in read(page).text


def test_a_survey_without_towers_says_so(page: Path, results: Results, thesis: Thesis):
    file = results.folder / "predict" / "fresh" / "fresh.towers.geojson"
    file.write_text('{"type": "FeatureCollection", "features": []}')
    write_report(results, thesis, page)
    assert "No tower was found in fresh." in read(page).text


def test_surveys_that_only_observers_see_are_listed_with_their_use(
    page: Path, results: Results, thesis: Thesis
):
    for name in ("south", "fresh"):
        check = read_json(results.folder / "check/north/report.json")
        (results.folder / "check" / name).mkdir()
        write_json(
            results.folder / "check" / name / "report.json", {**check, "warnings": [f"of {name}"]}
        )
    found = replace(results, observed=["south"])
    write_report(found, thesis, page)
    table = read(page).text.partition("Every survey of the run.")[2]
    uses = re.findall(r"(north|south|fresh)\s+(training of observers|training|classified)", table)
    assert uses == [
        ("north", "training"), ("south", "training of observers"), ("fresh", "classified")
    ]  # fmt: skip
    assert "of south" in table


def test_a_survey_with_lines_has_its_spans_and_its_worst_clearances(
    results: Results, thesis: Thesis, tmp_path: Path
):
    folder = results.folder / "predict" / "fresh"
    summary = read_json(folder / "fresh.summary.json")
    counts = {"dangers": 3, "few_points": 1, "fall_trees": 0, "nearest_m": {}, "kinds": "height",
              "limits": "66 kV: ours"}  # fmt: skip
    summary["line"] = {"lines": 1, "spans": 12, "conductors": 36, "earth_wires": 0, "cables": 0,
                       "to_look_at": 2, "positions": AS_FLOWN, "clearances": counts}  # fmt: skip
    write_json(folder / "fresh.summary.json", summary)
    for name, columns in (("spans", SPAN_COLUMNS), ("clearances", SPAN_CLEARANCE_COLUMNS)):
        rows = [{c.name: n if c.type in (int, float) else "" for c in columns} for n in range(12)]
        pd.DataFrame(rows).to_csv(folder / f"fresh.{name}.csv", index=False)
    found = with_observer(results)
    write_tables(found, thesis, found.folder / "tables", ["observers"])
    write_report(found, thesis, tmp_path / "page.html")
    page = read(tmp_path / "page.html")
    text = page.text
    assert "boosted trees" in text and "every point" in text
    assert {"lines", "observers"} <= {each.get("id") for each in page.all("section")}
    assert AS_FLOWN.capitalize() in text
    assert "The first 10 of 12 spans." in text
    assert "places closer than the limits" in text and "66 kV: ours" in text


def test_files_that_were_not_predicted_are_named_with_the_reason(
    page: Path, results: Results, thesis: Thesis
):
    file = results.folder / "predict" / "fresh" / "fresh.summary.json"
    row = {"file": "a.laz", "status": "predicted", "points": 5, "error": ""}
    bad = {**row, "file": "b.laz", "status": "failed", "error": "b.laz: it is a web page"}
    write_json(file, {**read_json(file), "files": [row, bad]})
    write_report(results, thesis, page)
    text = read(page).text
    assert "1 of 2 files of fresh were not predicted." in text
    assert "b.laz: it is a web page" in text


def test_a_broken_picture_is_named(page: Path, results: Results, thesis: Thesis):
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
def test_values_are_formatted_for_readers(value, how, text):
    assert write(value, how) == text


def test_the_page_leads_with_the_truth_where_it_is_known(
    results: Results, thesis: Thesis, tmp_path: Path
):
    known = with_truth(results)
    write_tables(known, thesis, known.folder / "tables")
    out = tmp_path / "index.html"
    sections = {section.id: section for section in write_report(known, thesis, out)}
    opening = " ".join(block.text for block in sections["overview"].blocks if block.kind == "text")
    assert "20% are tower in truth (precision); it finds 5% of the true tower voxels" in opening
    assert "they are 80% and 20%." in opening  # against the labels
    assert "F0.5 0.05, 0.05 below scenenet." in opening
    facts = next(block for block in sections["overview"].blocks if block.kind == "facts")
    assert ("precision of scenenet, against the truth", "0.200") in facts.items
    tables = [block for block in sections["models"].blocks if block.kind == "table"]
    assert [t.caption.split(":")[0] for t in tables[:4]] == [
        "Against the truth", "Against the labels", "Against the truth", "Against the labels",
    ]  # fmt: skip
    assert "0.17 ± 0.04" in tables[0].rows[0]  # precision: 0.2 and 0.15
    assert not any(column.published for column in tables[0].columns)
    assert "0.70 ± 0.14" in tables[1].rows[0]
    towers, of_labels, points, labelled = sections["positions"].blocks
    assert tuple(
        next(c.label for c in t.columns if c.label.endswith("towers")) for t in (towers, of_labels)
    ) == ("true towers", "labelled towers")
    assert "2.25 ± 0.00" in towers.rows[0] and "0.70 ± 0.00" in of_labels.rows[0]
    assert points.rows[-1][:2] == ["the labels", "-"]
    assert "0.38" in points.rows[-1] and "0.12 ± 0.00" in points.rows[0]
    assert len(labelled.rows) == len(points.rows) - 1


def test_without_a_truth_the_page_does_not_speak_of_it(page: Path):
    text = read(page).text
    assert "Against the labels" in text and "against the truth" not in text.lower()


def test_models_with_different_protocols_are_also_compared_alike(
    results: Results, thesis: Thesis, tmp_path: Path
):
    for seed in results.seeds:
        path = results.folder / "evaluate" / "scenenet" / f"seed-{seed}.json"
        result = read_json(path)
        result |= {"whole_towers": True, "voxel_towers": {**result["voxel"], "f05": 0.9}}
        write_json(path, result | {"voxel": result["voxel_towers"]})
    fresh = replace(results)
    write_tables(fresh, thesis, fresh.folder / "tables")
    out = tmp_path / "index.html"
    write_report(fresh, thesis, out)
    text = " ".join(read(out).text.split())
    assert "they count the voxels of whole towers" in text
    table = whole_towers(fresh).set_index("model")
    cnn = f"{table.loc['cnn', 'towers_f05']:.2f} against 0.90 for scenenet (whole towers)"
    assert f"Scored the same way, mean of 2 seeds: F0.5 {cnn}" in text
