"""The models that come with the package, one of towers and one of wires, each with its card.

The workflow trains them on synthetic surveys (rules ``packaged_model`` and ``packaged_wires``), and
``make model`` copies them here. They are never edited: a test compares each with the digest in its
card.
"""

from __future__ import annotations

from pathlib import Path

TOWERS, WIRES = PACKAGED = "towers", "wires"
"""Names of the models, which stand for their files on the command line."""


def packaged_model(name: str = TOWERS) -> Path:
    """A model file (``scenenet.models.model_file``); that of towers is what commands use without
    ``--model``."""
    return Path(__file__).with_name(f"{name}.json")


def packaged_card(name: str = TOWERS) -> Path:
    """The card of a model (Markdown): training data, use, limits and scores."""
    return Path(__file__).with_name(f"{name}.md")


def named_model(given: Path) -> Path:
    """The model file that a user names: that of the package where there is no such file."""
    return packaged_model(str(given)) if str(given) in PACKAGED and not given.exists() else given
