"""Folds are fixed, leave out every crop once, and never train on its neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from scenenet.core.errors import InputError
from scenenet.dataset.crops import Crop
from scenenet.dataset.folds import folds


def crop(name: str, x: float, radius: float = 20.0) -> Crop:
    return Crop(name, x, 0.0, radius, np.array([[x, 0.0]]))


def test_folds_follow_the_names_and_not_the_order_of_the_list():
    names = ["e", "b", "a", "d", "c"]
    crops = [crop(name, 1000.0 * ord(name)) for name in names]
    made = folds(crops, 2, neighbour=100)
    assert [[names[i] for i in fold.out] for fold in made] == [["a", "b"], ["c", "d"], ["e"]]
    for fold in made:
        assert sorted(fold.out + fold.train) == [0, 1, 2, 3, 4]
        assert fold.excluded == []


def test_neighbours_of_a_crop_that_is_left_out_are_excluded():
    crops = [crop(f"{i}", 70.0 * i) for i in range(8)]
    first, second, *_ = folds(crops, 2, neighbour=100)
    assert (first.out, first.excluded, first.train) == ([0, 1], [2], [3, 4, 5, 6, 7])
    assert (second.out, second.excluded, second.train) == ([2, 3], [1, 4], [0, 5, 6, 7])


def test_overlapping_crops_are_neighbours_at_any_neighbour_distance():
    crops = [crop("a", 0), crop("b", 35), crop("c", 400), crop("d", 800)]
    made = folds(crops, 1, neighbour=0)
    assert [fold.excluded for fold in made] == [[1], [0], [], []]


def test_too_few_crops_to_train_on_are_refused():
    crops = [crop(f"{i}", 70.0 * i) for i in range(4)]
    with pytest.raises(
        InputError, match="with 0, 1 left out, only 1 of 4 crops remain for training"
    ):
        folds(crops, 2, neighbour=100)
