"""Check the figures in README and docs against the runs that they come from: ``make claims``.

``docs/figures.yaml`` says where each figure comes from, and ``docs/results`` keeps the result
files of the runs. ``--write`` corrects tables and sentences, ``--keep RUN`` keeps the last run. The
claims of the thesis (``tables/claims.csv`` of every run) are another matter.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

from doc_tables import TABLES, tables_in, with_tables
from figure_tables import Table, tables_of, tidy
from kept_runs import (
    FIGURES,
    KEPT,
    Figures,
    Place,
    Sentence,
    Values,
    keep,
    keeping,
    kept_command,
    older,
    outlived,
    read_figures,
)

from scenenet.core.errors import InputError
from scenenet.core.files import write_text

ROOT = Path(__file__).resolve().parent.parent
MEASURED = re.compile(
    r"(?<![\w.])(?:\d+\.\d+|\d[\d ]*(?= ?%| (?:ms|s|seconds?|minutes?|hours?|[kKMGT]i?B)\b))"
)
"""A number that may be a measurement: with a decimal point, a percentage, a time or a size."""

REMEDY = "Correct it: python tools/doc_figures.py --write"
NOT_CHECKED = "`make claims` does not check"
"""What a page says of its figures if it is not covered."""


class Fault(NamedTuple):
    """A figure that does not follow from its run.

    Attributes:
        page: file in the project.
        line: 1 for the first.
        problem: what stands there, what the run gave, and the remedy.
    """

    page: str
    line: int
    problem: str


class Quote(NamedTuple):
    """A figure of a sentence in a page.

    Attributes:
        start, end: where it stands in the text.
        right: what the run gave.
        place: where that comes from.
    """

    start: int
    end: int
    right: str
    place: Place


FORMATS: Mapping[str, tuple[Callable[[float], str], str]] = {
    "{}": ("{:.2f}".format, r"[\d.]*\d"),
    "{:n}": (tidy, r"[\d.]*\d"),
    "{:%}": (lambda share: f"{100 * share:.0f}", r"\d+"),
}
"""What stands for a figure in ``docs/figures.yaml`` -> how it is written, and its pattern."""


def phrase(text: str) -> str:
    """Pattern of a text that may be broken into lines; what stands for figures becomes groups."""
    parts = re.split(r"(\{[^}]*\}|\s+)", text)
    return "".join(
        rf"({FORMATS[part][1]})" if part in FORMATS else re.escape(part) if part.strip() else r"\s+"
        for part in parts
        if part
    )


def quotes(page: str, text: str, sentence: Sentence, values: Values) -> list[Quote]:
    """The figures of a sentence in a page.

    Raises:
        InputError: the page does not have the sentence once, or it has another number of figures.
    """
    found = list(re.finditer(phrase(sentence.text), text))
    if len(found) != 1:
        raise InputError(
            f"stands there {len(found)} times and not once: {sentence.text!r}",
            file=page,
            remedy=f"Change the sentence here and in {FIGURES} alike, or delete it there",
        )
    formats = [part for part in re.findall(r"\{[^}]*\}", sentence.text) if part in FORMATS]
    if len(formats) != len(sentence.values):
        raise InputError(
            f"{len(formats)} figures and {len(sentence.values)} values: {sentence.text!r}",
            file=FIGURES,
        )
    return [
        Quote(*found[0].span(i), FORMATS[form][0](values[place]), place)
        for i, (form, place) in enumerate(zip(formats, sentence.values, strict=True), start=1)
    ]


def check(root: Path, results: bool = True) -> list[Fault]:
    """Every figure in README and docs that does not follow from a kept run.

    Args:
        root: the project.
        results: whether the kept runs must also be the last ones, where their results are there.

    Returns:
        what is wrong, in the order of the pages.
    """
    figures, values = read_figures(root), Values(root)
    tables, faults = tables_of(values, figures), []
    for page in covered(root, figures):
        text = (root / page).read_text(encoding="utf-8")
        faults += sorted(_page_faults(page, text, figures, values, tables), key=lambda f: f.line)
    faults += _other_pages(root, figures)
    for name, run in figures.runs.items():
        quoting = list(_quoting(root, figures, tables, name))
        if not any(run.command in (root / page).read_text(encoding="utf-8") for page in quoting):
            faults.append(Fault(FIGURES, 1, f"no page that quotes {name} shows {run.command!r}"))
        if kept_command(root, name) != run.command:
            faults.append(
                Fault(FIGURES, 1, f"{name} was kept from another command: run and keep it")
            )
        for file in outlived(root, run, name) if results else ():
            problem = f"has outlived its run: {run.results} differs. It is quoted in"
            remedy = f"Keep the last run: {keeping(name)} --write"
            faults.append(Fault(file, 1, f"{problem} {', '.join(quoting)}. {remedy}"))
    return faults


def _other_pages(root: Path, figures: Figures) -> Iterator[Fault]:
    """Pages that ``docs/figures.yaml`` names and that are not there, or not covered in silence."""
    for page in [*figures.sentences, *figures.no_measurement, *figures.not_covered]:
        if not (root / page).is_file():
            yield Fault(FIGURES, 1, f"there is no page {page}; remove it here")
        elif page in figures.not_covered:
            text = (root / page).read_text(encoding="utf-8")
            if not re.search(phrase(NOT_CHECKED), text):
                yield Fault(page, 1, f"must say {NOT_CHECKED!r}, because it is not covered")


def _quoting(root: Path, figures: Figures, tables: Mapping[str, Table], run: str) -> Iterator[str]:
    """The pages with sentences or tables of a run."""
    for page in covered(root, figures):
        places = (place for s in figures.sentences.get(page, ()) for place in s.values)
        shown = tables_in((root / page).read_text(encoding="utf-8"))
        of_tables = (name for name in shown if name in tables and run in tables[name].runs)
        if any(place[0].startswith(f"{run}/") for place in places) or any(of_tables):
            yield page


def covered(root: Path, figures: Figures) -> list[str]:
    """README and every page of docs but those that are not covered yet."""
    pages = ["README.md", *sorted(str(p.relative_to(root)) for p in (root / "docs").rglob("*.md"))]
    return [page for page in pages if page not in figures.not_covered]


def corrected(page: str, text: str, figures: Figures, values: Values) -> str:
    """A page with its tables and the figures of its sentences as the runs gave them."""
    found = [q for s in figures.sentences.get(page, ()) for q in quotes(page, text, s, values)]
    for quote in sorted(found, reverse=True):
        text = text[: quote.start] + quote.right + text[quote.end :]
    return with_tables(text, {n: t.make for n, t in tables_of(values, figures).items()})


def _page_faults(
    page: str,
    text: str,
    figures: Figures,
    values: Values,
    tables: Mapping[str, Table],
) -> Iterator[Fault]:
    known: list[tuple[int, int]] = []
    for name, shown in tables_in(text).items():
        start = text.index(f"<!-- {name} -->\n{shown}") + len(f"<!-- {name} -->\n")
        if name in tables or name in TABLES:
            known.append((start, start + len(shown)))
        if name in tables:
            run = _commands(figures, tables[name].runs)
            for i, problem in _differences(shown, tables[name].make()):
                yield Fault(page, _line(text, start) + i, f"{problem} in the run. {run}{REMEDY}")
    for sentence in figures.sentences.get(page, ()):
        try:
            found = quotes(page, text, sentence, values)
        except InputError as error:
            yield Fault(page, 1, str(error).removeprefix(f"{page}: "))
            continue
        for quote in found:
            known.append((quote.start, quote.end))
            stands = text[quote.start : quote.end]
            if stands != quote.right:
                problem = f"{stands} stands here, {quote.right} in {'; '.join(quote.place)}"
                run = _commands(figures, quote.place[0].split("/")[:1])
                yield Fault(page, _line(text, quote.start), f"{problem}. {run}{REMEDY}")
    for words, why in figures.no_measurement.get(page, {}).items():
        spans = [m.span() for m in re.finditer(phrase(words), text)]
        if not spans:
            yield Fault(page, 1, f"{words!r} ({why}) is not here; remove it from {FIGURES}")
        known += spans
    yield from (Fault(page, _line(text, at), p) for at, p in _unknown(text, figures, known))


def _differences(shown: str, right: str) -> Iterator[tuple[int, str]]:
    """Line and content of each difference between two tables."""
    before, after = shown.split("\n"), right.split("\n")
    if len(before) != len(after):
        yield 0, f"{len(before)} lines of a table stand here, {len(after)}"
    for i, (old, new) in enumerate(zip(before, after, strict=False)):
        if old != new and len(before) == len(after):
            cells = zip_longest(old.split("|"), new.split("|"), fillvalue="")
            a, b = next((a.strip(), b.strip()) for a, b in cells if a != b)
            yield i, f"{a!r} stands here, {b!r}"


def _unknown(
    text: str, figures: Figures, known: Iterable[tuple[int, int]]
) -> Iterator[tuple[int, str]]:
    """Where a number stands of which nothing is known, and the remedy."""
    blocks = r"^```.*?^```|`[^`\n]+`|\]\([^)]*\)|<!--.*?-->|https?://\S+"
    spans = [m.span() for m in re.finditer(blocks, text, re.DOTALL | re.MULTILINE)]
    for pattern in figures.kinds:
        spans += [m.span() for m in re.finditer(pattern, text)]
    spans += known
    for match in MEASURED.finditer(text):
        if not any(start <= match.start() < end for start, end in spans):
            problem = f"where does {match.group().strip()} come from? Name the run or the reason in"
            yield match.start(), f"{problem} {FIGURES} (docs/development/extending.md says how)"


def _line(text: str, position: int) -> int:
    return text.count("\n", 0, position) + 1


def _commands(figures: Figures, runs: Iterable[str]) -> str:
    """The commands of those of ``runs`` that are runs and not the thesis, as sentences."""
    return "".join(f"Run: {figures.runs[run].command}. " for run in runs if run in figures.runs)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--write", action="store_true", help="correct tables and sentences")
    parser.add_argument(
        "--keep",
        metavar="RUN",
        nargs="+",
        default=(),
        help="copy the files of runs to docs/results",
    )
    parser.add_argument("--results", type=Path, help="folder of these runs, if not their own")
    options = parser.parse_args()
    try:
        figures, values = read_figures(ROOT), Values(ROOT)
        for name in options.keep:
            if name not in figures.runs:
                raise InputError(f"no run {name!r}: {', '.join(figures.runs)}", file=FIGURES)
            run = figures.runs[name]
            files = keep(ROOT, name, run, options.results or ROOT / run.results)
            print(f"{KEPT}/{name}: {', '.join(files)}")
        pages = covered(ROOT, figures)
        texts = {page: (ROOT / page).read_text(encoding="utf-8") for page in pages}
        if options.write:
            right = {page: corrected(page, text, figures, values) for page, text in texts.items()}
            for page in (page for page in pages if right[page] != texts[page]):
                write_text(ROOT / page, right[page])
        faults = check(ROOT)
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    for fault in faults:
        print(f"{fault.page}:{fault.line}: {fault.problem}")
    for page, why in figures.not_covered.items():
        print(f"not covered: {page}: {why}")
    for name, run in figures.runs.items():
        if files := older(ROOT, name):
            print(f"by earlier code: {KEPT}/{name}: {', '.join(files)}. Run: {run.command}")
    sentences = sum(len(s.values) for page in figures.sentences.values() for s in page)
    print(
        f"{len(pages)} pages, {sentences} figures in sentences, "
        f"{len(tables_of(values, figures))} tables: {len(faults) or 'no'} differences"
    )
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
