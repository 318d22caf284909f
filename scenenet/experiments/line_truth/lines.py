"""The synthetic lines that are measured, and the options that choose them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from scenenet.experiments.wire_options import add_kinds
from scenenet.synthetic.settings import SyntheticSettings

POLES: Mapping[str, Any] = {"density": 20.0}
PYLONS: Mapping[str, Any] = {
    "height": (22, 40), "span": 310, "span_spread": 30, "half_width": 40, "circuits": 2,
    "earth_wires": 1, "bundle": 2, "catenary": 1600, "clearing": 6, "relief": 60, "density": 12,
    "tower_density": 18, "flight_height": (90, 130), "high_strays": 0.02,
}  # fmt: skip
"""Settings of lines of poles and of pylons, as in docs/method/synthetic.md."""

SETTINGS: Mapping[str, Mapping[str, Any]] = {"lattice": PYLONS, "window": PYLONS}
"""Settings of the line by the kind of its towers; others are ``POLES``."""


def line_of(
    kind: str, towers: int, seed: int, tension: float = 0.0, **others: float
) -> SyntheticSettings:
    """The settings of a line of towers of one kind.

    Args:
        tension: share of towers on straight stretches that end their conductors.
        others: settings that differ from those of the line.
    """
    own = {**SETTINGS.get(kind, POLES), "section": 0, "margin": 30.0, **others}
    return SyntheticSettings(**own, kinds={kind: 1.0}, towers=towers, seed=seed, tension=tension)


def add_line(parser: argparse.ArgumentParser, towers: int) -> None:
    """The options ``--kinds``, ``--towers``, ``--seed`` and ``--tension``.

    Args:
        towers: usual number of towers of a line.
    """
    add_kinds(parser)
    parser.add_argument(
        "--towers", type=int, default=towers, help=f"towers of a line (default {towers})"
    )
    parser.add_argument("--seed", type=int, default=5, help="of the surveys (default 5)")
    parser.add_argument(
        "--tension",
        type=float,
        default=0.0,
        help="share of towers on straight stretches that end their conductors; bends do then too "
        "(default 0)",
    )
