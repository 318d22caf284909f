"""The survey sheet is checked as a whole before anything runs."""

from __future__ import annotations

import json
from typing import get_args

import pytest

from scenenet.config.read_surveys import read_surveys
from scenenet.config.schema import load
from scenenet.config.survey import Survey, file_name
from scenenet.core.errors import InputError
from scenenet.pointcloud.class_schemes import SCHEMES, Codes

HEADER = "survey\tpath\tcodes\trole"


@pytest.fixture
def root(tmp_path):
    """A project with two surveys, a folder of samples and an inbox."""
    for path in ("data/north.laz", "data/south.las", "ts40k/a.npy", "inbox/new one.laz"):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_bytes(path.encode())
    (tmp_path / "empty").mkdir()
    (tmp_path / "bad.vpc").write_text("{}")
    return tmp_path


def read(root, *rows: str, header: str = HEADER, **settings) -> list[Survey]:
    sheet = root / "surveys.tsv"
    sheet.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    raw = {
        "models": [{"name": "scenenet", "kind": "scenenet"}],
        "seeds": [0],
        "surveys": "surveys.tsv",
        "new_surveys": {"folder": None},
        "synthetic": {"surveys": [{"name": "made"}]},
    }
    return read_surveys(load({**raw, **settings}), root)


def complaint(root, *rows: str, **more) -> str:
    with pytest.raises(InputError) as caught:
        read(root, *rows, **more)
    return str(caught.value)


def test_a_row_is_a_survey(root):
    assert read(root, "north\tdata/north.laz\tedp\ttrain") == [
        Survey("north", "data/north.laz", "edp", "train", "file")
    ]


def test_a_folder_a_pattern_and_an_index_are_one_survey_each(root):
    items = [{"assets": {"data": {"href": "data/north.laz"}}}]
    (root / "index.vpc").write_text(json.dumps({"features": items}))
    rows = [f"s{number}\t{path}\tedp\tnew"
            for number, path in enumerate(("data", "data/n*.laz", "index.vpc"))]  # fmt: skip
    assert [survey.origin for survey in read(root, *rows)] == ["tiles"] * 3


def test_a_folder_of_tiles_in_the_inbox_is_one_survey(root):
    (root / "inbox" / "line 7.2").mkdir()
    (root / "inbox" / "line 7.2" / "a.laz").write_bytes(b"")
    (root / "inbox" / "notes").mkdir()
    found = read(root, new_surveys={"folder": "inbox", "codes": "asprs"})
    assert found == [
        Survey("line_7.2", "inbox/line 7.2", "asprs", "new", "tiles"),
        Survey("new_one", "inbox/new one.laz", "asprs", "new", "file"),
    ]


def test_the_system_of_a_new_survey_may_be_named(root):
    header = f"{HEADER}\tcrs"
    rows = [
        "north\tdata/north.laz\tasprs\tnew\tEPSG:32629+5703",
        "south\tdata/south.las\tasprs\tnew\t",
        "samples\tts40k\tedp\ttrain",
    ]
    assert [survey.crs for survey in read(root, *rows, header=header)] == [
        "EPSG:32629+5703", None, None,
    ]  # fmt: skip
    for system, role, expected in (
        ("EPSG:99999", "new", "crs 'EPSG:99999' is not a coordinate system with x and y"),
        ("EPSG:5703", "new", "crs 'EPSG:5703' is not a coordinate system with x and y"),
        ("EPSG:32629", "train", "crs is only for the role new"),
    ):
        row = f"north\tdata/north.laz\tedp\t{role}\t{system}"
        assert f"line 2: {expected}" in complaint(root, row, header=header)


def test_columns_may_come_in_any_order_among_comments_and_empty_lines(root):
    header = "# my surveys\nrole\tsurvey\tcodes\tpath"
    rows = ["", "# the first", "new\tnorth\tasprs\tdata/north.laz"]
    assert read(root, *rows, header=header)[0].role == "new"


def test_a_sheet_saved_by_a_spreadsheet_is_read(root):
    """It starts with a byte order mark and has carriage returns."""
    assert read(root, "north\tdata/north.laz\tedp\ttrain\r", header=f"﻿{HEADER}\r")


def test_a_synthetic_survey_need_not_exist_yet(root):
    (survey,) = read(root, "corridor\t{results_dir}/synthetic/made.laz\tedp\ttrain")
    assert survey == Survey("corridor", "results/synthetic/made.laz", "edp", "train", "synthetic")


def test_the_path_of_a_synthetic_survey_follows_the_result_folder(root):
    row = "corridor\t{results_dir}/synthetic/made.laz\tedp\ttrain"
    assert read(root, row, results_dir="elsewhere")[0].path == "elsewhere/synthetic/made.laz"


def test_an_absolute_path_is_not_changed(root):
    path = str(root / "data" / "north.laz")
    assert read(root, f"north\t{path}\tedp\ttrain")[0].path == path


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ("north\tdata/nort.laz\tedp\ttrain", "did you mean data/north.laz?"),
        ("north\tdatta/north.laz\tedp\ttrain", "nor is its folder"),
        ("north\tdata/north.laz\tepd\ttrain", "codes 'epd' is not one of edp, asprs"),
        (
            "north\tdata/north.laz\tedp\ttraining",
            "role 'training' is not one of train, observe, new, did you",
        ),
        ("no rth/1\tdata/north.laz\tedp\ttrain", "such as 'no_rth_1'"),
        ("\tdata/north.laz\tedp\ttrain", "survey is empty"),
        ("north\tdata/north.laz\tedp", "role is empty"),
        ("north\tdata/north.laz\tedp\ttrain\tnote", "5 columns, where the first line names 4"),
        (
            "north\tdata\tedp\ttrain",
            "data is a survey of many LAS and LAZ files, which can",
        ),
        (
            "north\tempty\tedp\tnew",
            "empty is a folder without LAS and LAZ files, and",
        ),
        ("north\tdata/*.xyz\tedp\tnew", "data/*.xyz: no LAS or LAZ file matches this pattern"),
        ("north\tbad.vpc\tedp\tnew", "bad.vpc: this is not a tile index: no item in it has assets"),
        ("north\tsurveys.tsv\tedp\ttrain", "surveys.tsv is not one of .las, .laz, .npy, .pt"),
        ("north\tts40k\tedp\tnew", "is a folder; samples in a folder can only be trained on"),
        ("x\t{results_dir}/synthetic/mode.laz\tedp\ttrain", "{results_dir}/synthetic/made.laz?"),
    ],
)
def test_a_wrong_row_is_named_by_its_line(root, row, expected):
    message = complaint(root, "", row)
    assert message.startswith("surveys.tsv: one problem in the survey sheet\n  line 3: ")
    assert expected in message


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("x\x00.laz", r"the path 'x\x00.laz' has the control character '\x00'"),
        ("x" * 300 + ".laz", "xxx...' has a name of 304 bytes"),
        ("x/" * 3000 + "a.laz", "x/...' has 6005 bytes"),
        ("a{b}.laz", "the path 'a{b}.laz' has a brace, which Snakemake reads as a wildcard"),
        ("loop.laz", "loop.laz cannot be read: it is part of a loop of links"),
        ("loop.laz/a.laz", "loop.laz/a.laz cannot be read: it is part of a loop of links"),
        ("dead.laz", "dead.laz cannot be read: it is a link to gone.laz, which does not exist"),
    ],
    ids=["NUL", "long name", "long path", "brace", "loop", "folder in a loop", "dead link"],
)
def test_a_path_that_cannot_be_followed_is_named_by_its_line(root, path, expected):
    (root / "loop.laz").symlink_to("other.laz")
    (root / "other.laz").symlink_to("loop.laz")
    (root / "dead.laz").symlink_to("gone.laz")
    message = complaint(root, "", f"north\t{path}\tedp\ttrain")
    assert message.startswith("surveys.tsv: one problem in the survey sheet\n  line 3: ")
    assert expected in message
    assert len(message) < 300


def test_all_problems_are_reported_together(root):
    message = complaint(
        root,
        "north\tdata/north.laz\tedp\ttrain",
        "north\tdata/south.las\tedpp\ttrain",
        "south\tdata/gone.laz\tedp\ttest",
    )
    assert message.splitlines()[0] == "surveys.tsv: 4 problems in the survey sheet"
    assert "line 3: codes 'edpp'" in message
    assert "line 3: the name 'north' is on line 2 already" in message
    assert "line 4: role 'test'" in message
    assert "line 4: data/gone.laz is not there" in message


def test_every_class_scheme_is_accepted_in_the_sheet(root):
    assert get_args(Codes) == tuple(SCHEMES)
    assert read(root, "samples\tts40k\tts40k\ttrain")[0].codes == "ts40k"


def test_a_training_file_with_two_names_is_refused(root):
    """Its crops would be in the training part and in the test part."""
    rows = ["a\tdata/north.laz\tedp\ttrain", "b\tdata/../data/north.laz\tedp\ttrain"]
    assert "line 3: the file" in complaint(root, *rows)
    rows[1] = rows[1].replace("train", "new")
    assert [survey.role for survey in read(root, *rows)] == ["train", "new"]


def test_a_missing_column_is_reported_with_a_suggestion(root):
    message = complaint(root, header="survey\tpath\tcode\trole")
    assert "column 'codes' is missing" in message
    assert "column 'code' is not known, did you mean 'codes'?" in message


def test_commas_instead_of_tabs_are_reported(root):
    message = complaint(root, header="survey,path,codes,role")
    assert "line 1: the columns of the survey sheet must be separated by tabs" in message


def test_the_message_about_an_empty_sheet_names_the_columns(root):
    assert "survey, path, codes, role" in complaint(root, header="# nothing")


def test_a_missing_sheet_is_named(root):
    assert "gone.tsv: the survey sheet cannot be read" in complaint(root, surveys="gone.tsv")


def test_every_survey_in_the_inbox_is_new(root):
    inbox = {"folder": "inbox", "codes": "edp"}
    assert read(root, new_surveys=inbox) == [
        Survey("new_one", "inbox/new one.laz", "edp", "new", "file")
    ]


def test_the_inbox_skips_other_files_and_incomplete_copies(root):
    for name in ("notes.txt", ".half.laz", "sub/further/deep.laz"):
        (root / "inbox" / name).parent.mkdir(exist_ok=True, parents=True)
        (root / "inbox" / name).write_bytes(b"")
    (root / "inbox" / "tile.copc.laz").write_bytes(b"")
    names = [survey.name for survey in read(root, new_surveys={"folder": "inbox"})]
    assert names == ["new_one", "tile"]


def test_a_survey_of_the_sheet_is_not_taken_from_the_inbox_again(root):
    row = "mine\tinbox/new one.laz\tedp\tnew"
    assert [s.name for s in read(root, row, new_surveys={"folder": "inbox"})] == ["mine"]


def test_a_missing_inbox_is_empty(root):
    assert read(root, new_surveys={"folder": "nowhere"}) == []


def test_files_of_the_inbox_with_one_name_are_left_out_and_stop_no_other(root, capsys):
    (root / "inbox" / "new_one.las").write_bytes(b"")
    (root / "inbox" / "other.las").write_bytes(b"")
    assert [s.name for s in read(root, new_surveys={"folder": "inbox"})] == ["other"]
    warnings = capsys.readouterr().err.splitlines()
    assert len(warnings) == 2
    assert "two surveys would be called 'new_one': new one.laz and new_one.las" in warnings[0]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("a{b}.las", "has a brace, which Snakemake reads as a wildcard"),
        ("ab" * 20 + ".las", "20 or more repetitions"),
    ],
)
def test_a_name_that_snakemake_cannot_use_is_left_out(root, capsys, name, reason):
    (root / "inbox" / name).write_bytes(b"")
    assert [s.name for s in read(root, new_surveys={"folder": "inbox"})] == ["new_one"]
    error = capsys.readouterr().err
    assert f"left out: inbox/{name}" in error
    assert reason in error


@pytest.mark.parametrize(
    ("target", "reason"),
    [
        ("disk/gone.laz", "it is a link to disk/gone.laz, which does not exist. Mend or remove it"),
        ("gone.laz", "it is part of a loop of links. Mend or remove it"),
    ],
)
def test_a_link_in_the_inbox_that_leads_nowhere_is_left_out(root, capsys, target, reason):
    (root / "inbox" / "gone.laz").symlink_to(target)
    assert [s.name for s in read(root, new_surveys={"folder": "inbox"})] == ["new_one"]
    assert f"left out: inbox/gone.laz: {reason}" in capsys.readouterr().err


def test_a_folder_without_surveys_in_the_inbox_is_left_out(root, capsys):
    (root / "inbox" / "empty").mkdir()
    assert [s.name for s in read(root, new_surveys={"folder": "inbox"})] == ["new_one"]
    said = "left out: inbox/empty: it is not a folder of LAS and LAZ files"
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("row", ["ab" * 20 + "\tdata/north.laz", "mine\tdata/a{b}.laz"])
def test_a_row_that_snakemake_cannot_use_is_a_problem_of_the_sheet(root, row):
    (root / "data" / "a{b}.laz").write_bytes(b"")
    assert "Snakemake" in complaint(root, f"{row}\tedp\tnew")


def test_a_folder_of_ts40k_samples_is_one_survey(root):
    assert read(root, surveys=None, ts40k_dir="ts40k") == [
        Survey("ts40k", "ts40k", "edp", "train", "ts40k")
    ]


@pytest.mark.parametrize("folder", ["data", "gone"])
def test_a_folder_without_ts40k_samples_is_refused(root, folder):
    message = complaint(root, surveys=None, ts40k_dir=folder)
    assert f"{folder}: there are no TS40K samples" in message
    assert "--config ts40k_dir=FOLDER" in message


@pytest.mark.parametrize(
    ("text", "expected"), [("a b/c", "a_b_c"), ("--x..", "x"), ("évora", "vora"), ("  ", "survey")]
)
def test_names_become_valid_file_names(text, expected):
    assert file_name(text) == expected
