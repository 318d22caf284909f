"""Limits by voltage."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from scenenet.clearance.limits_file import read_limits
from scenenet.clearance.settings import DEFAULT_LIMITS, KINDS, ClearanceSettings
from scenenet.core.errors import InputError

HEAD = "voltage,ground,vegetation,building,wire,source\n"


def test_the_limits_are_those_of_the_next_voltage_of_the_table():
    assert ClearanceSettings().applied() is None
    assert ClearanceSettings(voltage=60).applied() == DEFAULT_LIMITS[2]
    assert ClearanceSettings(voltage=66).applied() == DEFAULT_LIMITS[2]
    with pytest.raises(InputError, match=r"no limits for 750 kV.*--limits"):
        ClearanceSettings(voltage=750).applied()


def test_no_default_limit_is_smaller_at_a_higher_voltage():
    for kind in KINDS:
        limits = [row.of(kind) for row in DEFAULT_LIMITS]
        assert limits == sorted(limits) and limits[0] > 0
    assert all("examples, to be replaced" in row.source for row in DEFAULT_LIMITS)


def test_a_table_of_limits_is_read_by_voltage(tmp_path):
    path = tmp_path / "limits.csv"
    path.write_text(HEAD + "110,6,3,4,3,rule 7\n30,5,2,3,2,\n", encoding="utf-8-sig")
    low, high = read_limits(path)
    assert (low.voltage, low.vegetation, low.source) == (30, 2, "limits.csv")
    assert (high.voltage, high.ground, high.source) == (110, 6, "rule 7")
    assert ClearanceSettings(voltage=50, limits=(low, high)).applied() == high


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("voltage,ground,vegetation,building\n30,5,2,3\n", "has no column wire"),
        (HEAD.replace("source", "note") + "30,5,2,3,2,a\n", "unknown column 'note'"),
        (HEAD + "30,5,two,3,2,\n", "line 2: vegetation"),
        (HEAD + "30,5,-2,3,2,\n", "line 2: vegetation"),
        (HEAD + "30,5,,3,2,\n", "line 2: vegetation"),
        (HEAD + "30,5,2,3,2,a\n30,5,2,3,2,b\n", "line 3: 30 kV is there twice"),
        (HEAD, "has no row"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused(tmp_path, text, problem):
    path = tmp_path / "limits.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=problem) as refused:
        read_limits(path)
    assert str(path) in str(refused.value)


def test_voltages_of_the_settings_ascend():
    with pytest.raises(ValidationError, match="ascend"):
        ClearanceSettings(limits=DEFAULT_LIMITS[::-1])
