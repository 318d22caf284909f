"""Decisions merged with a real prediction: the list changes as they say, and nothing is lost."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pyogrio
import pyproj
import pytest
import shapely
from fixtures.review_files import place, rows_of, write_rows
from fixtures.scenes import PLACE

COLUMNS = ("id", "x", "y", "decision", "comment", "reviewer", "base", "height")
ADDED = (PLACE[0] + 95.5, PLACE[1] + 33.5)


def _row(**cells: object) -> list[object]:
    """A row of a review file."""
    return [cells.get(column, "") for column in COLUMNS]


@pytest.fixture
def decisions(towers, tmp_path) -> Path:
    """A tower accepted, one rejected by its place, one with a comment, one added."""
    x, y = place(towers[1])
    rows = [
        _row(id=towers[0]["id"], decision="accept", comment="seen", reviewer="Ana"),
        _row(x=x + 1.5, y=y - 1, decision="Reject", comment="a crane", reviewer="João"),
        _row(id=towers[2]["id"], comment="leans"),
        _row(x=ADDED[0], y=ADDED[1], decision="add", reviewer="Ana", height=8.0),
        _row(id=towers[3]["id"]),
    ]
    return write_rows(tmp_path / "review.csv", COLUMNS, rows)


def test_decisions_change_the_list_and_lose_nothing(call, found, towers, decisions, tmp_path):
    out = tmp_path / "out"
    done = call("review", found, "--decisions", decisions, "--out", out, "--json")
    assert done.code == 0, done.err
    result = json.loads(done.out)
    assert result["counts"] == {
        "found": 12, "accepted": 1, "rejected": 1, "added": 1, "not_reviewed": 10, "comments": 3,
    }  # fmt: skip
    assert result["unmatched"] == [] and result["undecided_rows"] == 1
    rows = rows_of(out / "line.reviewed.csv")
    by_id = {row["id"]: row for row in rows}
    assert len(rows) == 12 and towers[1]["id"] not in by_id
    accepted = by_id[towers[0]["id"]]
    assert accepted.items() >= towers[0].items()
    assert (accepted["decision"], accepted["comment"], accepted["reviewer"]) == (
        "accepted", "seen", "Ana",
    )  # fmt: skip
    assert by_id[towers[2]["id"]]["decision"] == "not reviewed"
    assert by_id[towers[2]["id"]]["comment"] == "leans"
    [added] = [row for row in rows if row["decision"] == "added"]
    assert place(added) == ADDED
    assert float(added["height"]) == 8.0 and added["base"] == added["probability"] == ""
    [rejected] = rows_of(out / "line.rejected.csv")
    assert rejected.items() >= {**towers[1], "comment": "a crane", "reviewer": "João"}.items()


def test_the_layers_and_the_features_have_the_same(call, found, decisions, tmp_path):
    out = tmp_path / "out"
    assert call("review", found, "--decisions", decisions, "--out", out).code == 0
    package = out / "line.reviewed.gpkg"
    facts, _, geometry, values = pyogrio.raw.read(package, layer="towers")
    columns = dict(zip(facts["fields"], values, strict=True))
    assert pyproj.CRS(facts["crs"]).to_epsg() == 32629
    rows = rows_of(out / "line.reviewed.csv")
    assert list(columns) == list(rows[0])
    assert list(columns["decision"]) == [row["decision"] for row in rows]
    assert np.isnan(columns["probability"][-1]) and columns["height"][-1] == 8.0
    assert shapely.get_x(shapely.from_wkb(geometry[-1])) == ADDED[0]
    assert len(pyogrio.raw.read(package, layer="rejected")[2]) == 1
    features = json.loads((out / "line.reviewed.geojson").read_text())["features"]
    predicted = json.loads((found / "line.towers.geojson").read_text())["features"]
    before = next(f for f in predicted if f["id"] == features[0]["id"])
    # The reviewed list follows from the table, which has lengths to a tenth of a millimetre.
    place, known = (each["geometry"]["coordinates"] for each in (features[0], before))
    assert place[:2] == pytest.approx(known[:2], abs=2e-9)
    assert place[2] == pytest.approx(known[2], abs=1e-4)
    said = features[0]["properties"]
    for name, value in before["properties"].items():
        assert said[name] == (pytest.approx(value, abs=1e-4) if type(value) is float else value)
    assert len(features[-1]["geometry"]["coordinates"]) == 2  # its base is not known
    assert features[-1]["properties"]["probability"] is None


def test_a_reviewed_list_is_compared_with_a_register(call, found, towers, decisions, tmp_path):
    assert call("review", found, "--decisions", decisions, "--out", tmp_path).code == 0
    assets = write_rows(
        tmp_path / "assets.csv", ("id", "x", "y"), [("a", *place(towers[1])), ("b", *ADDED)]
    )
    done = call("register", tmp_path / "line.reviewed.csv", "--assets", assets, "--json")
    counts = json.loads(done.out)["counts"]
    assert (counts["missing"], counts["matched"], counts["new"]) == (1, 1, 11)
    again = call("review", tmp_path / "line.reviewed.csv", "--decisions", decisions)
    assert again.code == 1 and "was reviewed already" in again.err


@pytest.mark.parametrize("ending", ["csv", "gpkg"])
def test_the_template_has_the_doubtful_first_and_can_be_filled_in(
    call, found, towers, tmp_path, ending
):
    path = tmp_path / f"review.{ending}"
    done = call("review", found, "--template", path, "--json")
    assert done.code == 0, done.err
    order = json.loads(done.out)["towers"]
    assert {tower["id"] for tower in order} == {int(tower["id"]) for tower in towers}
    numbers = [len(tower["doubts"]) for tower in order]
    assert numbers == sorted(numbers, reverse=True) and numbers[0] > 0
    assert any("no conductors were found" in doubt for doubt in order[0]["doubts"])
    first, second = order[0]["id"], order[1]["id"]
    if ending == "csv":
        rows = rows_of(path)
        assert rows[0]["id"] == str(first)
        assert rows[0]["doubts"].startswith(order[0]["doubts"][0])
        for row, decision in zip(rows, ("reject", "accept"), strict=False):
            row["decision"] = decision
        with path.open("w", encoding="utf-8", newline="") as stream:
            table = csv.DictWriter(stream, list(rows[0]))
            table.writeheader()
            table.writerows(rows)
    else:
        facts, _, geometry, values = pyogrio.raw.read(path, layer="review")
        columns = dict(zip(facts["fields"], values, strict=True))
        assert columns["id"][0] == first
        columns["decision"][:2] = ["reject", "accept"]
        pyogrio.raw.write(
            path, geometry, list(columns.values()), list(columns), layer="review",
            geometry_type="Point", crs=facts["crs"],
        )  # fmt: skip
    merged = call("review", found, "--decisions", path, "--out", tmp_path, "--json")
    assert merged.code == 0, merged.err
    counts = json.loads(merged.out)["counts"]
    assert (counts["accepted"], counts["rejected"], counts["not_reviewed"]) == (1, 1, 10)
    assert rows_of(tmp_path / "line.rejected.csv")[0]["id"] == str(first)
    listed = rows_of(tmp_path / "line.reviewed.csv")
    assert [row["id"] for row in listed if row["decision"] == "accepted"] == [str(second)]
    refused = call("review", found, "--template", path)
    assert refused.code == 1 and "this file exists" in refused.err


def test_a_file_of_a_spreadsheet_and_a_layer_in_another_system(call, found, towers, tmp_path):
    x, y = (f"{value:.2f}".replace(".", ",") for value in place(towers[0]))
    text = f"Id;X [m];Y [m];Decision;Comment\r\n{towers[1]['id']};;;ACCEPTED;ja\r\n;;;;\r\n"
    text += f';{x};{y};rejected;"Kran; süd"\r\n'
    sheet = tmp_path / "sheet.csv"
    sheet.write_bytes(text.encode("cp1252"))
    there = pyproj.Transformer.from_crs(32629, 4326, always_xy=True)
    layer = tmp_path / "layer.gpkg"
    fields = {"decision": np.array(["add"], object), "comment": np.array(["seen"], object)}
    pyogrio.raw.write(
        layer, shapely.to_wkb(np.array([shapely.Point(*there.transform(*ADDED))], object)),
        list(fields.values()), list(fields), layer="review", geometry_type="Point",
        crs="EPSG:4326",
    )  # fmt: skip
    files = ("--decisions", sheet, "--decisions", layer)
    done = call("review", found / "line.gpkg", *files, "--out", tmp_path, "--json")
    assert done.code == 0, done.err
    assert json.loads(done.out)["counts"]["added"] == 1
    [rejected] = rows_of(tmp_path / "line.rejected.csv")
    assert (rejected["id"], rejected["comment"]) == (towers[0]["id"], "Kran; süd")
    rows = {row["decision"]: row for row in rows_of(tmp_path / "line.reviewed.csv")}
    assert rows["accepted"]["id"] == towers[1]["id"]
    assert place(rows["added"]) == pytest.approx(ADDED, abs=0.01)


def test_a_row_that_matches_nothing_is_reported_and_the_others_count(call, found, towers, tmp_path):
    rows = [
        _row(x=PLACE[0] + 35, y=PLACE[1] + 5, decision="reject"),
        _row(id=towers[0]["id"], decision="accept"),
        _row(x=PLACE[0] - 500, y=PLACE[1], decision="add"),
    ]
    path = write_rows(tmp_path / "review.csv", COLUMNS, rows)
    done = call("review", found, "--decisions", path, "--out", tmp_path, "--json")
    assert done.code == 0
    result = json.loads(done.out)
    assert result["counts"]["accepted"] == 1 and result["counts"]["rejected"] == 0
    [unmatched] = result["unmatched"]
    assert "row 2: reject: no tower was found within 5 m" in unmatched and unmatched in done.err
    assert "stands outside the coverage" in done.err


FAULTS = {
    "unknown id": (_row(id=77, decision="accept"), "no tower of line.towers.csv has the id 77"),
    "unknown decision": (_row(id="{0}", decision="maybe"), "'maybe' is not a decision"),
    "no tower": (_row(decision="reject"), "it names no tower"),
    "no place": (_row(decision="add"), "a tower is added without coordinates"),
    "half a place": (_row(x=1, decision="add"), "it has no y"),
    "no number": (_row(x="abc", y=2, decision="add"), "'abc' in column 'x' is not a number"),
    "half an id": (_row(id="12.5", decision="accept"), "is not a whole number"),
    "own id": (_row(id=5, x=500_000, y=4_630_000, decision="add"), "is added with the id 5"),
    "elsewhere": (
        _row(id="{0}", x=500_200, y=4_630_020, decision="accept"), "from the coordinates of this",
    ),
    "occupied": (_row(x="{x}", y="{y}", decision="add"), "a tower is added within 2 m of tower"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_named_with_its_row_and_nothing_is_written(
    call, found, towers, tmp_path, fault
):
    row, message = FAULTS[fault]
    known = {"{0}": towers[0]["id"], "{x}": towers[0]["x"], "{y}": towers[0]["y"]}
    rows = [
        _row(id=towers[1]["id"], decision="accept"),
        [known.get(str(cell), cell) for cell in row],
        _row(id=99, decision="reject"),
    ]
    path = write_rows(tmp_path / "review.csv", COLUMNS, rows)
    done = call("review", found, "--decisions", path, "--out", tmp_path / "out")
    assert done.code == 1
    assert f"review.csv: row 3: {message}" in done.err or (
        "review.csv: row 3: " in done.err and message in done.err
    )
    assert "row 4: no tower of line.towers.csv has the id 99" in done.err  # and the next one
    assert not (tmp_path / "out").exists()


def test_rows_that_contradict_each_other_are_named(call, found, towers, tmp_path):
    number, (x, y) = towers[0]["id"], place(towers[0])
    first = write_rows(
        tmp_path / "one.csv", COLUMNS, [_row(id=number, decision="accept", reviewer="Ana")]
    )
    rows = [
        _row(x=x, y=y, decision="reject"),
        _row(x=x + 15, y=y, decision="add"),
        _row(x=x + 16, y=y, decision="add"),
    ]
    second = write_rows(tmp_path / "two.csv", COLUMNS, rows)
    files = ("--decisions", first, "--decisions", second, "--out", tmp_path / "out")
    done = call("review", found, *files)
    assert done.code == 1
    assert "two.csv: row 2: it says reject, and one.csv, row 2 says accept" in done.err
    assert "two.csv: row 4: a tower is added within 2 m of one that another row adds" in done.err


def test_a_tower_is_moved_by_rejecting_and_adding_it(call, found, towers, tmp_path):
    x, y = place(towers[0])
    rows = [
        _row(id=towers[0]["id"], decision="reject"),
        _row(x=x + 0.5, y=y, decision="add"),
    ]
    path = write_rows(tmp_path / "review.csv", COLUMNS, rows)
    assert call("review", found, "--decisions", path, "--out", tmp_path).code == 0
    ids = [row["id"] for row in rows_of(tmp_path / "line.reviewed.csv")]
    assert len(set(ids)) == 12 and towers[0]["id"] not in ids


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "the file is empty"),
        ("id,comment\n1,a\n", "there is no column decision among id, comment"),
        ("decision,comment\naccept,a\n", "there is no column id, and no x and y"),
    ],
)
def test_a_file_that_is_no_review_is_named(call, found, tmp_path, text, message):
    path = tmp_path / "review.csv"
    path.write_text(text)
    done = call("review", found, "--decisions", path, "--out", tmp_path)
    assert done.code == 1 and message in done.err


def test_only_its_own_lists_are_replaced(call, found, decisions, tmp_path):
    review = ("review", found, "--decisions", decisions, "--out", tmp_path)
    assert [call(*review).code for _ in range(2)] == [0, 0]
    (tmp_path / "line.rejected.csv").write_text("my notes")
    refused = call(*review)
    assert refused.code == 1 and "line.rejected.csv: this file exists" in refused.err
    assert (tmp_path / "line.rejected.csv").read_text() == "my notes"
    assert call(*review, "--overwrite").code == 0


def test_options_that_do_not_go_together_are_refused(call, found, decisions, tmp_path):
    assert call("review", found).code == 2
    assert call("review", found, "--decisions", decisions, "--template", "t.csv").code == 2
    assert call("review", found, "--decisions", decisions, "--labels", "l.laz").code == 2
    assert call("review", found, "--decisions", decisions, "--accept-rest").code == 2
    assert call("review", found, "--template", tmp_path / "t.pdf").code == 1


def test_a_survey_without_towers_can_be_reviewed_and_compared(call, found, tmp_path):
    header = (found / "line.towers.csv").read_text().splitlines()[0]
    (tmp_path / "line.towers.csv").write_text(header + "\n")
    for name in ("line.gpkg", "line.laz", "line.summary.json"):
        (tmp_path / name).write_bytes((found / name).read_bytes())
    for ending in ("csv", "gpkg"):
        assert call("review", tmp_path, "--template", tmp_path / f"t.{ending}").code == 0
        done = call("review", tmp_path, "--decisions", tmp_path / f"t.{ending}", "--json")
        assert done.code == 0, done.err
        assert json.loads(done.out)["counts"]["found"] == 0
    review = write_rows(
        tmp_path / "add.csv", COLUMNS, [_row(x=ADDED[0], y=ADDED[1], decision="add")]
    )
    labels = ("--labels", tmp_path / "labelled.laz", "--codes", "asprs")
    assert call("review", tmp_path, "--decisions", review, *labels).code == 0
    [added] = rows_of(tmp_path / "line.reviewed.csv")
    assert float(added["height"]) == pytest.approx(8.0, abs=0.3)
    assets = write_rows(tmp_path / "assets.csv", ("id", "x", "y"), [("a", *ADDED)])
    done = call("register", tmp_path, "--assets", assets, "--json")
    assert json.loads(done.out)["counts"]["missing"] == 1
