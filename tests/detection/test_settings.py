"""The settings of the detection."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from scenenet.detection.settings import DetectionSettings


def test_the_old_name_of_a_setting_is_refused_with_the_new_one():
    with pytest.raises(ValidationError, match="min_wire is now called min_conductor"):
        DetectionSettings(min_wire=0)
