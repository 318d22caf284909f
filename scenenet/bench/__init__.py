"""How fast the engine is, beside what else there is for the same work.

``scenenet bench`` runs it; ``docs/method/performance.md`` tells what was measured and why it is so.

- ``crops``: what is measured on.
- ``peers``: the other ways to the same result.
- ``timing``: medians of interleaved runs.
- ``sections``: one function for each section of the answer.
- ``report``: the answer as tables.
"""

from __future__ import annotations

from scenenet.bench.measurements import BenchSettings, bench
from scenenet.bench.report import tables

__all__ = ["BenchSettings", "bench", "tables"]
