"""Optional dependencies: which extra of the package brings which module."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec

from scenenet.core.errors import InputError

EXTRAS: Mapping[str, tuple[str, ...]] = {
    "report": ("matplotlib", "jinja2"),
    "tracking": ("mlflow",),
    "workflow": ("snakemake", "pygments"),
}
"""Extra, as in ``pip install 'scenenet[EXTRA]'`` -> top-level modules that it brings."""


def require(extra: str, user: str) -> None:
    """Check that an extra is installed, before any work that would be lost without it.

    Args:
        extra: key of ``EXTRAS``.
        user: what needs it, for the message.

    Raises:
        InputError: a module of the extra is missing; the message says what to install.
    """
    missing = [module for module in EXTRAS[extra] if find_spec(module) is None]
    if missing:
        raise InputError(
            f"{user} needs {' and '.join(missing)}, which is not installed",
            remedy=f"Install it with: pip install 'scenenet[{extra}]'",
        )
