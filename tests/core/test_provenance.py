"""Inputs are identified by their content, and a result records its provenance."""

from __future__ import annotations

import os
import shutil

import pytest
import yaml

from scenenet.core import provenance
from scenenet.core.errors import InputError
from scenenet.core.provenance import fingerprint


@pytest.fixture
def survey(tmp_path):
    file = tmp_path / "survey.laz"
    file.write_bytes(b"points")
    return file


def test_a_touched_file_keeps_its_fingerprint(survey):
    before = fingerprint(survey)
    os.utime(survey, ns=(1, 1))
    assert fingerprint(survey) == before
    assert before.startswith("sha256:")


def test_another_file_with_an_older_date_has_another_fingerprint(survey, tmp_path):
    before = fingerprint(survey)
    other = tmp_path / "other.laz"
    other.write_bytes(b"POINTS")
    os.utime(other, ns=(1, 1))
    shutil.copy2(other, survey)  # as cp -p and rsync -a do
    assert fingerprint(survey) != before


def test_a_large_file_is_identified_by_size_and_date(survey):
    os.utime(survey, ns=(1, 1_500_000_001))
    assert fingerprint(survey, full_below_bytes=6) == "size-mtime:6-1500000001"
    assert fingerprint(survey, full_below_bytes=7).startswith("sha256:")


def test_a_large_file_that_is_replaced_by_an_older_one_has_another_fingerprint(survey):
    before = fingerprint(survey, full_below_bytes=0)
    os.utime(survey, ns=(1, 1))
    assert fingerprint(survey, full_below_bytes=0) != before


@pytest.fixture
def samples(tmp_path):
    folder = tmp_path / "samples"
    folder.mkdir()
    for name in ("a.npy", "b.pt"):
        (folder / name).write_bytes(name.encode())
    return folder


def test_a_folder_is_identified_by_its_samples(samples):
    before = fingerprint(samples)
    assert before.startswith("folder:2-")
    (samples / "notes.txt").write_text("not a sample")
    assert fingerprint(samples) == before
    (samples / "c.npy").write_bytes(b"c")
    assert fingerprint(samples) != before


@pytest.mark.parametrize("change", ["content", "name", "gone"])
def test_a_changed_sample_changes_its_folder(samples, change):
    before = fingerprint(samples)
    sample = samples / "a.npy"
    if change == "content":
        sample.write_bytes(b"A.npy")
    elif change == "name":
        sample.rename(samples / "z.npy")
    else:
        sample.unlink()
    assert fingerprint(samples) != before


def test_the_samples_of_a_large_folder_are_identified_by_size_and_date(samples):
    below = fingerprint(samples, full_below_bytes=10)  # of 5 bytes and 4
    above = fingerprint(samples, full_below_bytes=9)
    os.utime(samples / "a.npy", ns=(1, 1))
    assert fingerprint(samples, full_below_bytes=10) == below
    assert fingerprint(samples, full_below_bytes=9) != above


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"gone\.laz: cannot be read"):
        fingerprint(tmp_path / "gone.laz")


def test_a_record_has_a_seed_only_where_random_numbers_are_drawn():
    parts = ("train", {"epochs": 3}, {"split": "sha256:1"}, "code", "config")
    assert provenance.record(*parts, seed=0)["seed"] == 0
    record = provenance.record(*parts)
    assert list(record) == ["stage", "settings", "inputs", "code", "config", "version"]
    assert record["version"] == provenance.package_version()


def test_written_settings_can_be_read_back(tmp_path):
    settings = {"voxels": {"fit": "cube"}, "seeds": [0, 1], "surveys": None, "name": "évora"}
    provenance.write_settings(tmp_path / "config.yaml", settings)
    text = (tmp_path / "config.yaml").read_text(encoding="utf-8")
    assert yaml.safe_load(text) == settings
    assert text.startswith("# All settings")
