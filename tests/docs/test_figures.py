"""Every figure in README and docs is that of a kept run; ``make claims`` names each that is not."""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

import doc_figures
import figure_tables
import kept_runs
import pytest

ALONE = "| rules alone | yes | "
SENTENCE = "they reach 0.90 on the synthetic ones"


@pytest.fixture
def project(project_root: Path, tmp_path: Path) -> Path:
    """A copy of README and docs, to be changed."""
    shutil.copy(project_root / "README.md", tmp_path)
    shutil.copytree(
        project_root / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("images")
    )
    (tmp_path / "config").mkdir()
    shutil.copy(project_root / kept_runs.PUBLISHED, tmp_path / "config")
    shutil.copytree(project_root / "workflow" / "scripts", tmp_path / "workflow" / "scripts")
    return tmp_path


def _replace(page: Path, old: str, new: str) -> int:
    """Replace a text that stands there once; the line of its start."""
    text = page.read_text(encoding="utf-8")
    assert text.count(old) == 1
    page.write_text(text.replace(old, new), encoding="utf-8")
    return text[: text.index(old)].count("\n") + 1


def _places(faults: list[doc_figures.Fault]) -> list[tuple[str, int]]:
    return [(fault.page, fault.line) for fault in faults]


def _write(project: Path) -> None:
    figures, values = kept_runs.read_figures(project), kept_runs.Values(project)
    for name in doc_figures.covered(project, figures):
        page = project / name
        text = page.read_text(encoding="utf-8")
        page.write_text(doc_figures.corrected(name, text, figures, values), encoding="utf-8")


def test_the_figures_in_the_pages_are_those_of_their_runs(project_root: Path):
    assert doc_figures.check(project_root, results=False) == []


def test_a_figure_of_a_sentence_that_was_changed_by_hand_is_named(project: Path):
    readme = project / "README.md"
    before = readme.read_text(encoding="utf-8")
    number = re.search(r"they reach ([\d.]+) on the synthetic ones", before)
    assert number
    line = _replace(readme, number[0], number[0].replace(number[1], "0.99"))
    faults = doc_figures.check(project)
    assert _places(faults) == [("README.md", line)]
    assert f"0.99 stands here, {number[1]} in synthetic/components" in faults[0].problem
    assert "Run: snakemake" in faults[0].problem
    _write(project)
    assert readme.read_text(encoding="utf-8") == before


def test_a_cell_of_a_table_that_was_changed_by_hand_is_named(project: Path):
    readme = project / "README.md"
    before = readme.read_text(encoding="utf-8")
    row = next(row for row in before.splitlines() if row.startswith(ALONE))
    line = _replace(readme, row, row.replace("6 / 0", "6 / 1"))
    faults = doc_figures.check(project)
    assert _places(faults) == [("README.md", line)]
    assert "'6 / 1' stands here, '6 / 0' in the run" in faults[0].problem
    _write(project)
    assert readme.read_text(encoding="utf-8") == before


def test_a_row_that_was_taken_out_of_a_table_is_named(project: Path):
    page = project / "docs" / "method" / "accuracy.md"
    before = page.read_text(encoding="utf-8")
    head, table = before.split("<!-- figures of the six crops -->\n")
    row = next(row for row in table.splitlines(keepends=True) if row.startswith(ALONE))
    page.write_text(before[: len(head)] + before[len(head) :].replace(row, "", 1), "utf-8")
    first = head.count("\n") + 2
    assert _places(doc_figures.check(project)) == [("docs/method/accuracy.md", first)]
    _write(project)
    assert page.read_text(encoding="utf-8") == before


@pytest.mark.parametrize(
    "figure", ["F0.5 of 0.83", "87 % of the towers", "12 minutes", "| 0.42 |", "3 GB", "4 235.5 m"]
)
def test_a_figure_without_a_source_is_named(project: Path, figure: str):
    page = project / "docs" / "index.md"
    text = page.read_text(encoding="utf-8")
    page.write_text(f"{text}\nIt has {figure}.\n", encoding="utf-8")
    faults = doc_figures.check(project)
    assert _places(faults) == [("docs/index.md", text.count("\n") + 2)]
    assert doc_figures.FIGURES in faults[0].problem


def test_a_table_under_a_name_that_nothing_makes_is_no_source(project: Path):
    page = project / "docs" / "index.md"
    text = page.read_text(encoding="utf-8")
    page.write_text(f"{text}\n<!-- mine -->\n| 0.42 |\n<!-- end -->\n", encoding="utf-8")
    assert _places(doc_figures.check(project)) == [("docs/index.md", text.count("\n") + 3)]


@pytest.mark.parametrize(
    "text",
    ["`0.42`", "[here](a-0.42.md)", "thesis 5.2.4", "F0.5", "```\n0.42\n```", "2 m"],
)
def test_what_is_no_figure_needs_no_source(project: Path, text: str):
    page = project / "docs" / "index.md"
    page.write_text(f"{page.read_text(encoding='utf-8')}\n{text}\n", encoding="utf-8")
    assert doc_figures.check(project) == []


def test_a_sentence_that_was_reworded_is_named(project: Path):
    _replace(project / "README.md", "on the synthetic ones", "on synthetic crops")
    faults = doc_figures.check(project)
    assert {fault.page for fault in faults} == {"README.md"}
    assert any("stands there 0 times" in fault.problem for fault in faults)


def test_a_reason_for_a_phrase_that_is_gone_is_named(project: Path):
    line = "The interval has 95 %"
    _replace(project / "docs" / "method" / "claims.md", line, "The interval is wide")
    (fault,) = doc_figures.check(project)
    assert line in fault.problem
    assert fault.page == "docs/method/claims.md"


def test_a_page_that_is_not_covered_says_so(project: Path):
    _replace(project / "docs" / "method" / "numbers.md", "does not check", "checks")
    assert [fault.page for fault in doc_figures.check(project)] == ["docs/method/numbers.md"]


def test_a_run_is_quoted_with_the_command_that_made_it(project: Path):
    page = project / "docs" / "method" / "accuracy.md"
    _replace(page, "--config ts40k_dir=FOLDER", "--config ts40k_dir=ELSEWHERE")
    (fault,) = doc_figures.check(project)
    assert "no page that quotes ts40k shows" in fault.problem
    _replace(project / doc_figures.FIGURES, "ts40k_dir=FOLDER", "ts40k_dir=ELSEWHERE")
    (fault,) = doc_figures.check(project)
    assert "ts40k was kept from another command" in fault.problem


def _last_run(project: Path) -> Path:
    """The results of the six crops, as their run writes them, with one tower more that is false."""
    text = (project / kept_runs.KEPT / "ts40k" / "components.csv").read_text(encoding="utf-8")
    head, *rows = text.splitlines()
    cells = rows[0].split(",")
    cells[head.split(",").index("towers_false")] = "3"
    folder = project / "results" / "ts40k" / "components" / "all"
    folder.mkdir(parents=True)
    path = folder / "runs.csv"
    path.write_text("\n".join([head, ",".join(cells), *rows[1:]]) + "\n", encoding="utf-8")
    made_by = {"stage": "components", "code": "abc", "config": "def"}
    (folder / "provenance.json").write_text(json.dumps(made_by), encoding="utf-8")
    return path


def test_pages_that_outlived_their_run_are_named_and_follow_the_last_one(
    project, monkeypatch, capsys
):
    _last_run(project)
    (fault,) = doc_figures.check(project)
    assert fault.page == "docs/results/ts40k/components.csv"
    assert "README.md, docs/method/accuracy.md" in fault.problem
    assert "--keep ts40k" in fault.problem
    assert doc_figures.check(project, results=False) == []
    monkeypatch.setattr(doc_figures, "ROOT", project)
    monkeypatch.setattr(sys, "argv", ["doc_figures.py", "--keep", "ts40k", "--write"])
    assert doc_figures.main() == 0
    printed = capsys.readouterr().out
    assert "no differences" in printed
    assert "by earlier code: docs/results/ts40k: components/all/runs.csv" in printed
    record = json.loads((project / kept_runs.KEPT / "ts40k" / "run.json").read_text("utf-8"))
    assert record["files"][0]["code"] == "abc"
    assert doc_figures.check(project) == []


def test_the_exit_code_says_whether_all_is_right(project, monkeypatch, capsys):
    monkeypatch.setattr(doc_figures, "ROOT", project)
    monkeypatch.setattr(sys, "argv", ["doc_figures.py"])
    assert doc_figures.main() == 0
    line = _replace(project / "README.md", "P 0.68 and R 0.16", "P 0.68 and R 0.19")
    assert doc_figures.main() == 1
    assert f"README.md:{line}: 0.19 stands here, 0.16 in thesis" in capsys.readouterr().out


def test_a_place_that_the_run_does_not_have_is_named(project: Path):
    values = kept_runs.Values(project)
    with pytest.raises(ValueError, match=r"ts40k/components\.csv: 0 rows begin with 'no such'"):
        values["ts40k/components", "no such", "point_f05"]
    with pytest.raises(ValueError, match="no such run is kept"):
        values["none/components", "rules alone", "point_f05"]


def test_the_single_values_of_json_files_become_a_table(tmp_path: Path):
    results = tmp_path / "results"
    results.mkdir()
    for name, found in (("a", 3), ("b", None)):
        scores = {"truth": {"towers": {"found": found}, "curve": [1, 2]}, "alive": True}
        (results / f"{name}.scores.json").write_text(json.dumps(scores), encoding="utf-8")
    run = kept_runs.Run(
        title="two", command="make two", results="results", files={"two.csv": "*.scores.json"}
    )
    assert kept_runs.keep(tmp_path, "both", run, results) == ["a.scores.json", "b.scores.json"]
    values = kept_runs.Values(tmp_path)
    assert [*values.rows("both", "two")[0]] == ["file", "truth.towers.found", "alive"]
    assert values["both/two", "a", "truth.towers.found"] == 3
    with pytest.raises(ValueError, match="1 rows begin with 'b' and a number in"):
        values["both/two", "b", "truth.towers.found"]
    assert figure_tables.csv_table(
        values, "both", "two", {"file": "x", "truth.towers.found": "y"}
    ) == ("| x | y |\n|---|---|\n| a | 3 |\n| b |  |")


def test_files_of_different_columns_are_not_joined(tmp_path: Path):
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text(f"{name}\n1\n", encoding="utf-8")
    run = kept_runs.Run(title="", command="", results="", files={"all.csv": "*.csv"})
    with pytest.raises(ValueError, match=r"b\.csv: the columns are not those of .*a\.csv"):
        kept_runs.keep(tmp_path, "all", run, tmp_path)
