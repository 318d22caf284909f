"""``scenenet geneo``: the workbench for kernels."""

from __future__ import annotations

from scenenet.cli.commands.geneo import all_kernels, certify, new_kernel, one_kernel, trial

COMMANDS = {
    "list": all_kernels,
    "show": one_kernel,
    "new": new_kernel,
    "try": trial,
    "certify": certify,
}
HELP = "List, show, write and try kernels; certify models."
EPILOG = "scenenet geneo COMMAND --help explains a command, with examples."
