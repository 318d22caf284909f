"""``snakemake --report`` shows every table and figure with a caption."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.workflow

NOWHERE = "http://127.0.0.1:9"
"""A proxy that does not exist, so that every access to the network fails."""


@pytest.fixture(scope="module")
def reported(copied):
    """A copy of the finished project whose report is made, without access to a network."""
    proxies = ("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY")
    with pytest.MonkeyPatch.context() as environment:
        for name in proxies:
            environment.setenv(name, NOWHERE)
        environment.setenv("no_proxy", "")
        project = copied()
        project.run("--report", "out.html")
    return project


@pytest.fixture(scope="module")
def shown(reported) -> dict[str, dict]:
    """Path of a result -> its entry in the report, with category and subcategory."""
    html = (reported.folder / "out.html").read_text(encoding="utf-8")
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=[\"']http", html)
    results = _variable(html, "results")
    for category, groups in _variable(html, "categories").items():
        for group, paths in groups.items():
            for path in paths:
                results[path] |= {"category": category, "group": group}
    return results


def _variable(html: str, name: str) -> dict:
    begin = re.search(rf'<script id="{name}">\s*var {name} = ', html)
    return json.JSONDecoder().raw_decode(html, begin.end())[0]


def test_the_report_has_every_result_with_a_caption_and_changes_nothing(reported, shown):
    made = [
        *reported.results.glob("tables/*.csv"),
        *reported.results.glob("figures/*.png"),
        *reported.results.glob("study/*/runs.csv"),
        *reported.results.glob("predict/*/*.towers.geojson"),
        reported.results / "report/index.html",
        reported.results / "models/scenenet.json",
        reported.results / "config.yaml",
    ]
    assert len(made) > 25
    missing = {str(path.relative_to(reported.folder)) for path in made} - set(shown)
    assert missing == set()
    for path, entry in shown.items():
        text = re.sub(r"<[^>]+>", "", entry["caption"])
        assert len(text) > 40, path
        assert "{" not in text and "Undefined" not in text, path
        assert entry["category"] in {
            "1 Page", "2 Models", "3 New surveys", "4 Studies", "5 Data", "6 How it was made"
        }, path  # fmt: skip
        assert entry["labels"], path
        assert entry["data_uri"].startswith("data:"), path
    # Two entries with the same labels would share a row, and one of them could not be opened.
    rows = [(e["category"], e["group"], *e["labels"].values()) for e in shown.values()]
    assert len(rows) == len(set(rows))
    assert reported.planned() == {}


def test_captions_describe_their_own_result(shown):
    assert "own" in shown["results/figures/prediction-own.png"]["caption"]
    assert "ablations" in shown["results/figures/study-ablations.png"]["caption"]
    assert "0, 1" in shown["results/tables/models.csv"]["caption"]
    assert shown["results/figures/training-cnn.png"]["labels"] == {"figure": "Training of cnn"}
    assert shown["results/tables/study-ablations.csv"]["labels"]["asks"] == (
        "Which operators does it need?"
    )


def test_another_caption_reruns_nothing(project):
    project.edit("workflow/report/figure-crop.rst", "A test crop", "One of the test crops")
    project.edit("workflow/rules/captions.smk", '"6 How it was made"', '"6 Provenance"')
    project.edit("workflow/rules/report.smk", '"Report page"', '"Page"')
    assert project.planned() == {}


def test_every_caption_belongs_to_a_result(project_root: Path):
    rules = "".join(p.read_text() for p in (project_root / "workflow/rules").glob("*.smk"))
    for caption in (project_root / "workflow/report").glob("*.rst"):
        kind = caption.stem.removeprefix("figure-").removeprefix("table-")
        named = kind in rules or caption.stem == "workflow"
        drawn = f'"{kind}' in (project_root / "scenenet/figures/catalogue.py").read_text()
        tabled = f'"{kind}"' in (project_root / "scenenet/results/tables.py").read_text()
        assert named or drawn or tabled, caption.name
