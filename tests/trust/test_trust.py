"""A small part of the trust suite; ``make trust`` runs all of it."""

from __future__ import annotations

import io
import re
import subprocess
import sys
import zipfile

import laspy
import pytest
from trust import kills, mutations, replaced, storage
from trust.damage import damaged
from trust.originals import FORMATS, SUFFIX, originals
from trust.processes import environment
from trust.table import Attempt, Skipped, Subject, run, table

MUTATIONS = {"las": 40, "laz": 20, "copc": 20, "npy": 40, "pt": 30, "json": 25, "safetensors": 25}
"""Format -> files, 200 in all; each file of a compressed format starts a decoder."""
FIRST = 1
"""Number 0 would go through the command line, which the tests of that do."""


def nothing_lost(subject: Subject, folder, numbers) -> None:
    tally = run(subject, folder / "trust", 0, numbers)
    assert not tally.lost, "\n".join(tally.lost)
    assert tally.tried == len(numbers)


def named(module, name: str) -> Subject:
    return next(subject for subject in module.SUBJECTS if subject.name == name)


@pytest.mark.parametrize("kind", FORMATS)
def test_damaged_files_give_an_answer_or_an_input_error(kind, tmp_path):
    subject = named(mutations, f"mutations of {kind}")
    nothing_lost(subject, tmp_path, range(FIRST, FIRST + MUTATIONS[kind]))


def test_a_killed_prediction_leaves_nothing_and_is_made_by_the_next_start(tmp_path):
    nothing_lost(named(kills, "kill -9 of predict"), tmp_path, [1, 5, 9])


def test_a_full_disk_leaves_a_message_and_no_result(tmp_path):
    number = storage.LIMIT_CASES.index(("synth", 1000))  # predict: tests/cli/test_outputs.py
    nothing_lost(named(storage, "disk full: limit on file sizes"), tmp_path, [number])


def test_a_survey_replaced_while_it_is_read_gives_no_mixed_result(tmp_path):
    number = replaced.CASES.index((replaced.MOMENTS[0], "shifted by 5 m", False))
    nothing_lost(named(replaced, "survey replaced while it is read"), tmp_path, [number])


# The suite itself


def test_the_octree_of_the_copc_file_is_one(tmp_path):
    path = tmp_path / f"in{SUFFIX['copc']}"
    path.write_bytes(originals("copc")[0])
    with laspy.CopcReader.open(path) as reader:
        assert len(reader.query()) == reader.header.point_count == 2380
        assert len(reader.query(level=0)) == 595


@pytest.mark.parametrize("kind", FORMATS)
def test_damage_is_the_same_for_the_same_number_and_seed(kind):
    contents = originals(kind)
    made = [damaged(kind, contents, 3, number) for number in range(30)]
    assert made == [damaged(kind, contents, 3, number) for number in range(30)]
    assert made != [damaged(kind, contents, 4, number) for number in range(30)]
    assert sum(data not in contents for data, _ in made) >= 25


def test_damage_inside_an_archive_keeps_its_checksums():
    (content,) = originals("pt")
    readable = 0
    for number in range(200):
        data, what = damaged("pt", [content], 0, number)
        if ": " in what and "," not in what:  # inside a member, once
            assert zipfile.ZipFile(io.BytesIO(data)).testzip() is None
            readable += 1
    assert readable > 50


BAD_READER = """
import os
import numpy
from trust import reader

def unknown(path): raise KeyError("units")
def hungry(path): numpy.ones(2**28)
def broken(path): os.abort()

acts = [unknown, hungry, broken]
reader.read_intact = lambda *intact: None
reader._read_model = lambda path: acts.pop(0)(path)
reader.main()
"""


def test_the_suite_notices_what_a_bad_reader_does(tmp_path):
    worker = mutations.Worker("json", tmp_path, 0, ["-c", BAD_READER])
    lost = [worker.ask(number, False)["lost"] for number in (1, 2, 3)]
    worker.close()
    assert lost[0] == "KeyError: 'units' (<string>:6)"
    assert re.fullmatch(r"\d+ MiB of memory were used, more than 1024", lost[1])
    assert lost[2].startswith("the reader ended by signal SIGABRT")


def test_the_suite_notices_a_reader_that_hangs(tmp_path, monkeypatch):
    monkeypatch.setattr(mutations, "READ_SECONDS", 0.2)
    hangs = "import time; print('ready', flush=True); time.sleep(600)"
    worker = mutations.Worker("json", tmp_path, 0, ["-c", hangs])
    assert worker.ask(1, False)["lost"] == "no answer within 0.2 s"
    worker.close()


def test_the_table_counts_and_names_how_to_repeat(tmp_path):
    def tries(folder, seed, numbers):
        yield Attempt(0, "nothing")
        yield Attempt(7, "something", "a file")
        yield Skipped("not here")

    tally = run(Subject("all", tries, 2), tmp_path / "trust", 5)
    assert (tally.tried, tally.survived) == (2, 1)
    assert tally.lost[0].startswith("all 7: something: a file\n")
    assert tally.lost[0].endswith("python -m trust --only 'all' --seed 5 --number 7")
    assert tally.skipped == ["all: skipped: not here"]
    head, row, total = table([tally]).splitlines()
    assert head.split() == ["subject", "tried", "survived", "lost", "seconds"]
    assert row.split()[1:4] == total.split()[1:4] == ["2", "1", "1"]


def test_the_exit_code_says_whether_anything_was_lost(tmp_path):
    command = [sys.executable, "-m", "trust", "--only", "of npy", "--count", "3"]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].split()[1:4] == ["3", "3", "0"]
