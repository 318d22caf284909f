"""The split: parts by stretch of line, without neighbours in different parts."""

from __future__ import annotations

import json
from itertools import combinations, pairwise

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pydantic import ValidationError

from scenenet.core.errors import InputError
from scenenet.dataset.split import GUARD, PARTS, SplitSettings, crops_in, split_crops

ROUNDING_M = 1e-6


def manifest(path, survey: str, xy, radius=20.0):
    xy = np.asarray(xy, float).reshape(-1, 2)
    radii = np.broadcast_to(radius, len(xy))
    crops = [
        {"id": f"{survey}-{i:04d}", "x": x, "y": y, "radius": float(r)}
        for i, ((x, y), r) in enumerate(zip(xy.tolist(), radii, strict=True))
    ]
    path.write_text(json.dumps({"survey": survey, "crops": crops}))
    return path


def straight(n: int, spacing: float = 100.0, start=(0.0, 0.0)):
    return np.column_stack([np.arange(n) * spacing, np.zeros(n)]) + np.asarray(start)


def leaks(table: pd.DataFrame, neighbour: float) -> list[tuple[str, str]]:
    """Consecutive crops of a survey that are neighbours and are in different parts.

    The rows of the table follow the line; see test_labelled_towers for the order.
    """
    return [
        (a.crop, b.crop)
        for a, b in pairwise(table.itertuples())
        if a.survey == b.survey
        and np.hypot(a.x - b.x, a.y - b.y) < neighbour - ROUNDING_M
        and a.part != b.part
        and GUARD not in (a.part, b.part)
    ]


def overlaps(table: pd.DataFrame, radius: dict[str, float]) -> list[tuple[str, str]]:
    """Crops of a survey that overlap and are in different parts, without guards."""
    kept = table[table["part"] != GUARD]
    return [
        (a.crop, b.crop)
        for a, b in combinations(kept.itertuples(), 2)
        if a.survey == b.survey
        and a.part != b.part
        and np.hypot(a.x - b.x, a.y - b.y) < radius[a.crop] + radius[b.crop] - ROUNDING_M
    ]


@st.composite
def lines(draw):
    """Towers along a line that may turn by up to 150 degrees at each tower, and return."""
    n = draw(st.integers(3, 40))
    steps = np.array(draw(st.lists(st.floats(30, 600), min_size=n, max_size=n)))
    turns = np.array(draw(st.lists(st.floats(-2.6, 2.6), min_size=n, max_size=n)))
    heading = np.cumsum(turns * draw(st.sampled_from([0.0, 0.2, 1.0])))
    xy = np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]) * steps[:, None], axis=0)
    return xy[draw(st.permutations(range(n)))]


@given(
    lines(),
    st.floats(5, 80),
    st.integers(1, 6),
    st.sampled_from([0.0, 50.0, 200.0, 500.0]),
    st.integers(0, 5),
)
@example(straight(40), 20.0, 4, 500.0, 0)
def test_no_neighbours_and_no_overlapping_crops_in_different_parts(
    tmp_path_factory, xy, radius, stretch, neighbour, seed
):
    path = manifest(tmp_path_factory.mktemp("line") / "m.json", "a", xy, radius)
    settings = SplitSettings(stretch=stretch, neighbour=neighbour, seed=seed)
    try:
        table = split_crops([path], settings)
    except InputError as error:
        assert "no crop remains" in str(error)
        return
    assert leaks(table, neighbour) == []
    assert overlaps(table, dict.fromkeys(table["crop"], radius)) == []
    assert sorted(table["crop"]) == [f"a-{i:04d}" for i in range(len(xy))]
    assert set(PARTS) <= set(table["part"]) <= {*PARTS, GUARD}


def test_overlapping_crops_stay_together_at_any_neighbour_distance(tmp_path):
    xy = straight(24, 100.0)
    path = manifest(tmp_path / "m.json", "a", xy, radius=[60.0, 60.0, 30.0, 30.0] * 6)
    table = split_crops([path], SplitSettings(stretch=1, neighbour=0.0))
    parts = table.set_index("crop")["part"]
    for i in range(0, 24, 4):  # the first of four overlaps the second, and no other
        assert parts[f"a-{i:04d}"] == parts[f"a-{i + 1:04d}"] != GUARD


def test_a_line_that_returns_next_to_itself_stays_in_one_part_there(tmp_path):
    out = straight(10, 100.0)
    back = np.column_stack([np.arange(9, -1, -1) * 100.0 + 100.0, np.full(10, 90.0)])
    far = straight(20, 100.0, (0, 50_000))
    path = manifest(tmp_path / "m.json", "a", np.concatenate([out, back, far]), radius=50.0)
    for seed in range(5):
        table = split_crops([path], SplitSettings(stretch=1, neighbour=0.0, seed=seed))
        assert overlaps(table, dict.fromkeys(table["crop"], 50.0)) == []


def test_parts_have_about_their_shares(tmp_path):
    path = manifest(tmp_path / "m.json", "a", straight(400, 600.0))
    table = split_crops([path], SplitSettings(neighbour=500.0, stretch=4))
    shares = table["part"].value_counts(normalize=True)
    for part, share in {"train": 0.2, "validation": 0.1, "test": 0.7}.items():
        assert shares[part] == pytest.approx(share, abs=0.02)
    assert GUARD not in shares


def test_one_crop_is_left_out_at_each_border_of_parts_and_no_other(tmp_path):
    path = manifest(tmp_path / "m.json", "a", straight(80))
    table = split_crops([path], SplitSettings(stretch=4))
    parts = table["part"].tolist()
    guards = [i for i, part in enumerate(parts) if part == GUARD]
    assert guards
    for i in guards:
        assert 0 < i < len(parts) - 1
        assert parts[i - 1] != parts[i + 1]
    drawn = table[table["part"] != GUARD].groupby("stretch")["part"].first()
    borders = sum(a != b for a, b in pairwise(drawn))
    assert len(guards) == borders


def test_a_stretch_ends_after_its_number_of_towers_and_at_a_gap_of_the_line(tmp_path):
    xy = np.concatenate([straight(6), straight(6, start=(5000, 0))])
    path = manifest(tmp_path / "m.json", "a", xy)
    table = split_crops([path], SplitSettings(stretch=4))
    sizes = table.groupby("stretch", sort=False).size().tolist()
    assert sizes == [4, 2, 4, 2]
    assert table["stretch"].iloc[0] == "a-001"


def test_same_seed_same_split_and_other_seed_other_split(tmp_path):
    path = manifest(tmp_path / "m.json", "a", straight(60))
    one, same, other = (split_crops([path], SplitSettings(seed=s)) for s in (3, 3, 4))
    pd.testing.assert_frame_equal(one, same)
    assert one["part"].tolist() != other["part"].tolist()


def test_surveys_are_separate_lines(tmp_path):
    paths = [
        manifest(tmp_path / f"{s}.json", s, straight(12, start=(0, i * 1e5)))
        for i, s in enumerate("abc")
    ]
    table = split_crops(paths, SplitSettings())
    assert table.groupby("survey").size().to_dict() == {"a": 12, "b": 12, "c": 12}
    assert not set(table.loc[table["survey"] == "a", "stretch"]) & set(
        table.loc[table["survey"] == "b", "stretch"]
    )


@pytest.mark.parametrize("n", [0, 1, 2])
def test_fewer_crops_than_parts_are_refused_with_a_remedy(tmp_path, n):
    path = manifest(tmp_path / "m.json", "a", straight(n))
    with pytest.raises(InputError, match=rf"{n} crops cannot be split.*Add surveys"):
        split_crops([path], SplitSettings())


def test_an_empty_list_of_surveys_is_refused():
    with pytest.raises(InputError, match="0 crops"):
        split_crops([], SplitSettings())


def test_a_line_too_short_for_three_parts_is_refused_with_a_remedy(tmp_path):
    path = manifest(tmp_path / "m.json", "a", straight(5))
    with pytest.raises(InputError, match=r"no crop remains for .*out of 5 crops in 2 stretches"):
        split_crops([path], SplitSettings(stretch=4))


def test_a_part_without_a_share_may_be_empty(tmp_path):
    path = manifest(tmp_path / "m.json", "a", straight(20, 600.0))
    settings = SplitSettings(train=0.8, validation=0.2, test=0.0)
    assert set(split_crops([path], settings)["part"]) == {"train", "validation"}


def test_shares_must_sum_to_one():
    with pytest.raises(ValidationError, match="must sum to 1"):
        SplitSettings(train=0.5)


def test_crops_of_a_part_are_read_from_the_file(tmp_path):
    rows = "survey,crop,part\na,001,train\na,002,guard\nb,003,train\n"
    (tmp_path / "split.csv").write_text(rows)
    assert crops_in(tmp_path / "split.csv", "train") == {"001", "003"}
    assert crops_in(tmp_path / "split.csv", "test") == set()
