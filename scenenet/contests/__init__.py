"""SCENE-Net beside its rivals, trained on the same crops and scored on the same others.

- ``settings``: which models, and on what.
- ``folds``, ``cross_validation``: every crop once left out.
- ``noisy_line``, ``noise``: labels of which a known share is wrong (thesis 5.2.5).
"""

from __future__ import annotations

from scenenet.contests.settings import Contender, CrossValidationSettings, NoiseSettings

__all__ = ["Contender", "CrossValidationSettings", "NoiseSettings"]
