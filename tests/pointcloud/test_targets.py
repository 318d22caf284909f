"""Targets: names and codes of what an observer finds."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.pointcloud import class_scheme
from scenenet.pointcloud.targets import LONGEST_NAME, ROLES, TOWER, Target


@pytest.mark.parametrize(
    ("text", "scheme", "codes"),
    [
        ("tower", "edp", {15}),
        ("tower", "ts40k", {4}),
        ("wire", "edp", {16, 17}),
        ("wire", "asprs", {13, 14}),
        ("wire=14", "asprs", {14}),
        ("vegetation", "asprs", {3, 4, 5}),
        ("ground", "ts40k", {1}),
        ("14,16", "edp", {14, 16}),
        ("lamp=14", "edp", {14}),
    ],
)
def test_a_target_has_the_codes_of_its_role_or_its_own(text, scheme, codes):
    target = Target.parse(text)
    every = np.arange(256, dtype=np.uint8)
    assert set(every[target.among(every, class_scheme(scheme))].tolist()) == codes


@pytest.mark.parametrize(
    ("text", "name", "canonical"),
    [
        ("wire", "wire", "wire"),
        ("16, 14,16", "class_14_16", "class_14_16=14,16"),
        ("lamp = 16,14", None, None),
        ("lamp=16, 14", "lamp", "lamp=14,16"),
    ],
)
def test_equal_targets_have_one_text(text, name, canonical):
    if name is None:
        with pytest.raises(InputError, match="cannot be the name"):
            Target.parse(text)
        return
    target = Target.parse(text)
    assert (target.name, target.text) == (name, canonical)
    assert Target.parse(target.text) == target


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("wires", "there is no target 'wires'. Choose tower, wire, vegetation, ground"),
        ("", "there is no target ''"),
        ("256", "not a list of class codes from 0 to 255"),
        ("lamp=", "not a list of class codes"),
        ("lamp=14;16", "not a list of class codes"),
        ("tower=4", "the codes of target tower follow from the class scheme"),
        ("Lamp=14", "lower-case letters"),
        ("1,2,3,4,5,6,7,8,9,10", "more than the 32 of a LAS dimension"),
    ],
)
def test_a_text_that_names_no_target_is_refused(text, message):
    with pytest.raises(InputError, match=message):
        Target.parse(text)


def test_the_longest_name_fits_into_a_las_dimension():
    longest = "l" * LONGEST_NAME
    assert len(f"{Target.parse(f'{longest}=14').name}_probability") == 32
    assert all(len(name) <= LONGEST_NAME for name in ROLES)


def test_only_the_tower_leads_to_towers():
    assert [Target.parse(name).is_tower for name in ROLES] == [name == "tower" for name in ROLES]
    assert not Target.parse("pole=15").is_tower
    assert TOWER.text == "tower"
