"""The pictures of the documentation, taken from what a run has left: ``make pictures``.

Opens the page and MLflow's own pages in Chromium, as a reader would, and writes ``docs/images``.
Needs a run with the studies ``ablations`` and ``alpha-epsilon`` in the folder it is called in, the
extra ``dev`` and Chromium (on Debian and Ubuntu: apt install chromium).
"""

from __future__ import annotations

import argparse
import contextlib
import json
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenenet.core.errors import InputError
from scenenet.core.files import atomic
from scenenet.tracking.ui import comparison, experiment_runs, metric_over_steps, serving

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Run
    from playwright.sync_api import Browser, BrowserContext, Page

IMAGES = Path(__file__).resolve().parent.parent / "docs" / "images"
WIDTH = 1200
COLOURS = 128
"""In the palette; text and charts need no more, and the files are a third of their size."""

PATIENCE_MS = 60_000
"""How long a page may take to show what is waited for."""

PREFERENCES = {
    "mlflow.workflowType_v1": '"machine_learning"',
    "mlflow.assistant.panelOpen_v1": "false",
    "mlflow.assistant.fab.autoOpenedOnFirstLoad_v1": "true",
}
"""What somebody who uses MLflow for trainings has chosen in it: "Model training" at the top left,
and the assistant closed."""

SCROLL_TO_METRIC = """async ([name, patience]) => {
  const end = performance.now() + patience;
  const drawn = () => new Promise((done) => setTimeout(() => requestAnimationFrame(done), 0));
  const grids = () => [...document.querySelectorAll("[role=grid]")].slice(-2);
  const row = () => [...document.querySelectorAll("[role=grid] a")]
    .find((link) => link.textContent.trim() === name);
  for (let top = 0; !row() && top < grids()[1].scrollHeight; top += grids()[1].clientHeight) {
    grids()[1].scrollTop = top;
    await drawn();
    await drawn();
  }
  if (!row()) return false;
  // The names lie in a table of their own, which MLflow always scrolls to where the values were
  // before: two steps bring both to the metric, one pixel apart.
  const [names, values] = grids();
  const place = parseFloat(row().parentElement.style.top);
  const [before, first] = [names.scrollTop, place + (values.scrollTop === place)];
  values.scrollTop = first;
  while (names.scrollTop === before && performance.now() < end) await drawn();
  values.scrollTop = 2 * place + 1 - first;
  while (names.scrollTop !== first && performance.now() < end) await drawn();
  return Math.abs(names.scrollTop - values.scrollTop) <= 1;
}"""
"""Whether the metric is there; it is then at the top."""

SHOWN_SCORES = ("f05", "precision", "recall", "iou_tower", "miou")
"""What the table of runs shows, of the crops that were scored."""


def chromium() -> str | None:
    """The browser of this machine."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((found for name in names if (found := shutil.which(name))), None)


@dataclass(frozen=True)
class _Running:
    """A process of Chromium.

    Attributes:
        browser: to ask it.
        contexts: of its pages, by colour scheme. Pages of one context share what they load, so
            that the program of MLflow is compiled once and not with every page.
    """

    browser: Browser
    contexts: dict[str, BrowserContext]

    def context(self, scheme: str) -> BrowserContext:
        if scheme not in self.contexts:
            made = self.browser.new_context(color_scheme=scheme)
            made.set_default_timeout(PATIENCE_MS)
            self.contexts[scheme] = made
        return self.contexts[scheme]


_running: list[_Running] = []


@contextlib.contextmanager
def one_browser() -> Iterator[None]:
    """Open all pages inside the block in one process of Chromium: to start it takes longer than
    most pages."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=["--disable-gpu"])
        _running.append(_Running(browser, {}))
        try:
            yield
        finally:
            _running.pop().browser.close()


@contextlib.contextmanager
def browsing(
    scheme: str = "light", width: int = WIDTH, height: int = 900, **stored: str
) -> Iterator[Page]:
    """A page in Chromium, without anything remembered but MLflow's preferences.

    Args:
        scheme: ``light`` or ``dark``.
        width, height: of the window, px.
        stored: what else the browser remembers of its last visit, as in ``localStorage``.
    """
    remembered = json.dumps(PREFERENCES | stored)
    with contextlib.nullcontext() if _running else one_browser():
        page = _running[-1].context(scheme).new_page()
        page.set_viewport_size({"width": width, "height": height})
        page.add_init_script(f"Object.assign(localStorage, {remembered})")
        try:
            yield page
        finally:
            page.evaluate("localStorage.clear()")
            page.close()


@dataclass(frozen=True)
class Tracked:
    """An MLflow store, and its runs by experiment.

    Attributes:
        client: to ask it.
        address: where its pages are served.
        experiment: name of the experiment of the trainings; studies are called after it.
    """

    client: MlflowClient
    address: str
    experiment: str = "scenenet"

    def id_of(self, study: str | None = None) -> str:
        name = self.experiment if study is None else f"{self.experiment}-{study}"
        found = self.client.get_experiment_by_name(name)
        if found is None:
            raise InputError(f"the store has no experiment {name!r}", remedy="Run the workflow")
        return str(found.experiment_id)

    def runs(self, study: str | None = None, filter_string: str = "") -> list[Run]:
        """Runs in the order of their names."""
        found = self.client.search_runs([self.id_of(study)], filter_string, max_results=1000)
        return sorted(found, key=lambda run: str(run.info.run_name))

    def variants(self, study: str) -> list[Run]:
        """The runs of a study that hold the means over the seeds."""
        return [run for run in self.runs(study) if "seed" not in run.data.tags]

    def comparison(self, runs: Sequence[Run]) -> str:
        ids = [run.info.run_id for run in runs]
        return comparison(self.address, runs[0].info.experiment_id, ids)


def save(image: bytes, out: Path, colours: int = COLOURS) -> None:
    """Write a screenshot as a PNG with a palette, whole or not at all.

    Args:
        colours: in the palette.
    """
    import io

    from PIL import Image

    picture = Image.open(io.BytesIO(image)).convert("RGB")
    reduced = picture.quantize(colours, dither=Image.Dither.NONE)
    with atomic(out) as partial:
        reduced.save(partial, format="PNG", optimize=True)


def take_page(report: Path, out: Path) -> None:
    """The top of the page, light."""
    with browsing(height=1000) as page:
        page.goto(report.resolve().as_uri())
        page.locator("h1").first.wait_for()
        save(page.screenshot(), out / "report.png")


def take_survey(survey: Path, out: Path) -> None:
    """The page of a survey with its second tower selected, light."""
    with browsing(width=1400, height=1250) as page:
        page.goto(survey.resolve().as_uri())
        page.get_by_role("button", name="Next").click()
        save(page.screenshot(), out / "survey.png")


def take_spans(survey: Path, out: Path) -> None:
    """The page of a survey with a line, with its longest span selected, light."""
    with browsing(width=1400, height=1400) as page:
        page.goto(survey.resolve().as_uri())
        heading = page.locator("#spans thead button", has_text="length")
        heading.dblclick()
        page.locator("#spans tbody button").first.click()
        page.locator("#spans tbody button").first.blur()
        page.evaluate("scrollTo(0, 0)")
        save(page.screenshot(), out / "spans.png", 256)


def take_experiments(store: Tracked, out: Path) -> None:
    """The list of experiments, one for each study."""
    with browsing(height=520) as page:
        page.goto(f"{store.address}/#/experiments")
        page.get_by_text(f"{store.experiment}-ablations").first.wait_for()
        save(page.screenshot(), out / "mlflow-experiments.png")


def take_runs(store: Tracked, out: Path) -> None:
    """The variants of the ablation study, ticked; and what *Compare* then shows."""
    experiment = store.id_of("ablations")
    variants = store.variants("ablations")
    with browsing(height=640, **_columns(experiment, variants)) as page:
        page.goto(experiment_runs(store.address, experiment))
        page.get_by_text(str(variants[0].info.run_name)).first.wait_for()
        page.get_by_role("checkbox").first.check(force=True)
        page.get_by_role("button", name="Compare").wait_for()
        save(page.screenshot(), out / "mlflow-runs.png")
    with browsing(height=800) as page:
        open_comparison(page, store, variants)
        save(page.screenshot(), out / "mlflow-compare.png")


def take_seeds(store: Tracked, out: Path) -> None:
    """The seeds of a SCENE-Net: their scores, and the path of one number."""
    seeds = store.runs(filter_string="tags.model = 'scenenet' and tags.seed != ''")
    with browsing(height=760) as page:
        open_comparison(page, store, seeds)
        for section in ("Visualizations", "Run details", "Parameters"):
            page.get_by_role("button", name=section, exact=True).click()
        scroll_to_metric(page, "test_average_precision")
        save(page.screenshot(), out / "mlflow-seeds.png")
    ids = [run.info.run_id for run in seeds]
    with browsing(height=760) as page:
        metric = "negative_sphere.omega"
        page.goto(metric_over_steps(store.address, store.id_of(), ids, metric))
        page.locator(".js-plotly-plot .scatterlayer .trace").nth(len(ids) - 1).wait_for(
            state="attached"
        )
        save(page.screenshot(), out / "mlflow-path.png")


def take_grid(store: Tracked, out: Path) -> None:
    """Alpha and epsilon against the score."""
    with browsing(height=760) as page:
        open_comparison(page, store, store.variants("alpha-epsilon"))
        save(page.screenshot(), out / "mlflow-grid.png")


def open_comparison(page: Page, store: Tracked, runs: Sequence[Run]) -> None:
    """Open the comparison of ``runs`` and wait until it is drawn and its table is there."""
    page.goto(store.comparison(runs))
    page.get_by_text(f"Comparing {len(runs)} Runs").wait_for()
    page.get_by_text(str(runs[0].info.run_name), exact=True).first.wait_for()
    page.locator(".js-plotly-plot svg").first.wait_for(state="attached")


def scroll_to_metric(page: Page, name: str) -> None:
    """Bring a metric to the top of the table of a comparison, which draws what is scrolled to.

    Raises:
        InputError: the table has no such metric.
    """
    page.get_by_role("grid").last.wait_for()
    if not page.evaluate(SCROLL_TO_METRIC, [name, PATIENCE_MS]):
        raise InputError(f"the comparison shows no metric {name!r}", remedy="Run the workflow")


def _columns(experiment: str, runs: Sequence[Run]) -> dict[str, str]:
    """The table of runs with its scores, as *Columns* in MLflow sets it."""
    measured = {name for run in runs for name in run.data.metrics}
    wanted = [f"{part}_{score}" for part in ("test", "validation") for score in SHOWN_SCORES]
    names = [name for name in wanted if name in measured]
    state: dict[str, Any] = {"selectedColumns": [f"metrics.`{name}`" for name in names]}
    key = f'MLflowLocalStorage-1.1-ExperimentPage-["{experiment}"]-ReactComponentState'
    return {key: json.dumps(state)}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--results", type=Path, default=Path("results"), help="result folder")
    parser.add_argument("--uri", default="sqlite:///mlflow.db", help="MLflow store of the run")
    parser.add_argument("--out", type=Path, default=IMAGES, help="where the pictures go")
    parser.add_argument(
        "--survey", type=Path, help="take only this page, which scenenet predict has written"
    )
    asked = parser.parse_args(arguments)
    try:
        if chromium() is None:
            raise InputError("there is no Chromium", remedy="apt install chromium")
        if asked.survey is not None:
            take_survey(asked.survey, asked.out)
        else:
            take(asked.results, asked.uri, asked.out)
    except InputError as error:
        sys.exit(f"Error: {error}")


def take(results: Path, uri: str, out: Path) -> None:
    """Take every picture.

    Raises:
        InputError: there is no page, or the store has not the studies.
    """
    from mlflow import MlflowClient

    report = results / "report" / "index.html"
    if not report.is_file():
        raise InputError("is not there", file=report, remedy="Run the workflow first: snakemake")
    take_page(report, out)
    for survey in sorted(results.glob("predict/*/*.html"))[:1]:
        take_survey(survey, out)
    with serving(uri) as address:
        store = Tracked(MlflowClient(address), address)
        for take_some in (take_experiments, take_runs, take_seeds, take_grid):
            take_some(store, out)
            print(f"{take_some.__name__}: done", file=sys.stderr)


if __name__ == "__main__":
    main()
