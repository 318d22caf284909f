"""The trust suite: ``make trust``, or ``PYTHONPATH=tests python -m trust`` with options.

It tries to lose something, and prints what was tried, what survived and what was lost. Exit code 1
if anything was lost.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from trust import concurrency, kills, mutations, recordings, replaced, reruns, storage
from trust.table import Subject, Tally, run, table

MODULES = (reruns, kills, mutations, storage, recordings, replaced, concurrency)
"""The longest first."""
SUBJECTS = [subject for module in MODULES for subject in module.SUBJECTS]


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m trust", description=__doc__)
    parser.add_argument("--only", help="only the subjects whose name contains this text")
    parser.add_argument("--seed", type=int, default=0, help="of the damage and of the moments")
    parser.add_argument("--number", type=int, help="only the attempt with this number")
    parser.add_argument("--count", type=int, help="at most so many attempts of each subject")
    parser.add_argument("--keep", type=Path, help="new folder to work in, which is kept")
    given = parser.parse_args()
    chosen = [subject for subject in SUBJECTS if given.only is None or given.only in subject.name]
    if not chosen:
        parser.error(f"no subject is called {given.only}: {[s.name for s in SUBJECTS]}")
    work = given.keep or Path(tempfile.mkdtemp(prefix="trust-"))

    def do(place: int, subject: Subject) -> Tally:
        count = min(subject.count, given.count or subject.count)
        one = given.number is not None and subject.one_by_one
        numbers = [given.number] if one else range(count)
        print(f"{subject.name} ...", file=sys.stderr, flush=True)
        tally = run(subject, work / str(place), given.seed, numbers)
        print("\n".join([*tally.skipped, *tally.lost, table([tally])]), file=sys.stderr, flush=True)
        return tally

    try:
        with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            tallies = list(pool.map(do, range(len(chosen)), chosen))
    finally:
        if given.keep is None:
            shutil.rmtree(work, ignore_errors=True)
    for tally in tallies:
        print("\n".join([*tally.skipped, *tally.lost]), end="\n" if tally.lost else "")
    print(table(tallies))
    return int(any(tally.lost for tally in tallies))


if __name__ == "__main__":
    sys.exit(main())
