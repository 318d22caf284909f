"""Speed of the package compared with alternative implementations of the same work.

``scenenet bench`` runs it; ``docs/method/performance.md`` has the measurements and explains them.

- ``crops``: the crops that are measured on.
- ``peers``: the alternative implementations.
- ``timing``: medians of interleaved runs.
- ``measurements``: one function for each part of the benchmark.
- ``thesis_training``: the training of the thesis at its scale.
- ``report``: the result as tables.
"""

from __future__ import annotations

from scenenet.bench.measurements import BenchSettings, bench
from scenenet.bench.report import tables

__all__ = ["BenchSettings", "bench", "tables"]
