"""The model that comes with the package, with its card.

The workflow trains it on synthetic surveys (rule ``packaged_model``), and ``make model`` copies it
here. It is never edited: a test compares it with the digest in its card.
"""

from __future__ import annotations

from pathlib import Path

MODEL = "towers.json"
CARD = "towers.md"


def packaged_model() -> Path:
    """The model file (``scenenet.models.model_file``) that commands use without ``--model``."""
    return Path(__file__).with_name(MODEL)


def packaged_card() -> Path:
    """Its model card (Markdown): training data, use, limits and scores."""
    return Path(__file__).with_name(CARD)
