"""The pages of MLflow show the runs of the workflow with the names and numbers of our tables."""

from __future__ import annotations

import csv
import re
import shutil
from pathlib import Path

import pytest

from scenenet.tracking.ui import experiment_runs, metric_over_steps, serving

pytestmark = pytest.mark.workflow

METRICS = """async () => {
  const title = [...document.querySelectorAll("[role=button]")]
    .find((one) => one.textContent.trim() === "Metrics");
  const grids = title ? [...title.parentElement.querySelectorAll("[role=grid]")].slice(-2) : [];
  if (grids.length < 2) return {};
  const names = {}, values = {};
  const left = (cell) => parseFloat(cell.style.left);
  for (let top = 0; top < grids[1].scrollHeight; top += 100) {
    grids[1].scrollTop = top;
    await new Promise((done) => setTimeout(done, 50));
    const [heads, cells] = grids.map((one) => [...one.querySelector("[role=rowgroup]").children]);
    for (const head of heads) {
      const row = cells.filter((cell) => cell.style.top === head.style.top);
      if (!row.length) continue;
      names[head.style.top] = head.textContent.trim();
      values[head.style.top] = row.sort((a, b) => left(a) - left(b))
        .map((cell) => cell.textContent.trim());
    }
  }
  return Object.fromEntries(Object.keys(names).map((top) => [names[top], values[top]]));
}"""
"""Metric -> what each run has, from the table of the comparison, which draws only the rows that are
scrolled to."""

LARGE = {"width": 1800, "height": 2400}
ATTEMPTS, ATTEMPT_MS = 60, 500
HALF_A_DIGIT = 0.00051
"""MLflow shows three decimals."""

NOT_FOUND = re.compile("page not found|something went wrong|cannot load|error loading", re.I)


@pytest.fixture(scope="module")
def store(finished, pictures, tmp_path_factory):
    """The pages of MLflow over a copy of the store of the finished run."""
    from mlflow import MlflowClient

    database = tmp_path_factory.mktemp("store") / "mlflow.db"
    shutil.copyfile(finished.folder / "mlflow.db", database)
    with serving(f"sqlite:///{database}") as address:
        yield pictures.Tracked(MlflowClient(address), address)


def rows_of(table: Path) -> list[dict[str, str]]:
    with table.open() as stream:
        return list(csv.DictReader(stream))


def metrics_of(page, runs: int, named: str) -> dict[str, list[float]]:
    """The table of metrics, once it shows the metric ``named``."""
    for _ in range(ATTEMPTS):
        found = page.evaluate(METRICS)
        if len(found.get(named, [])) == runs:
            break
        page.wait_for_timeout(ATTEMPT_MS)
    assert len(found.get(named, [])) == runs, found
    return {name: [float(value or "nan") for value in row] for name, row in found.items()}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_variants_of_the_ablation_study_are_compared(finished, store, pictures, scheme):
    """The way of a user: the list of runs, all selected, *Compare*."""
    table = rows_of(finished.results / "tables" / "study-ablations.csv")
    names = [row["variant"] for row in table]
    with pictures.browsing(scheme=scheme, **LARGE) as page:
        page.goto(experiment_runs(store.address, store.id_of("ablations")))
        for name in names:
            page.get_by_text(name, exact=True).first.wait_for()
        page.get_by_role("checkbox").first.check(force=True)
        page.get_by_role("button", name="Compare").click()
        page.get_by_text(f"Comparing {len(names)} Runs").wait_for()
        metrics = metrics_of(page, len(names), "test_recall")
        text = page.locator("body").inner_text()
        order = sorted(names, key=text.index)
        paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert not NOT_FOUND.search(text)
    by_name = {row["variant"]: row for row in table}
    for score in ("precision", "recall", "f05", "iou_tower", "miou"):
        ours = [float(by_name[name][score]) for name in order]
        assert metrics[f"test_{score}"] == pytest.approx(ours, abs=HALF_A_DIGIT), score
    assert (sum(int(part) for part in re.findall(r"\d+", paper)[:3]) < 200) == (scheme == "dark")


def test_seeds_are_compared_and_the_path_of_a_parameter_is_drawn(finished, store, pictures):
    seeds = store.runs(filter_string="tags.model = 'scenenet' and tags.seed != ''")
    ours = [r for r in rows_of(finished.results / "tables/seeds.csv") if r["model"] == "scenenet"]
    assert [run.info.run_name for run in seeds] == [f"scenenet seed {r['seed']}" for r in ours]
    with pictures.browsing(**LARGE) as page:
        pictures.open_comparison(page, store, seeds)
        metrics = metrics_of(page, len(seeds), "test_recall")
        for score in ("precision", "recall", "f05"):
            tabled = [float(row[score]) for row in ours]
            assert metrics[f"test_{score}"] == pytest.approx(tabled, abs=HALF_A_DIGIT), score
        ids = [run.info.run_id for run in seeds]
        omega = "negative_sphere.omega"
        page.goto(metric_over_steps(store.address, store.id_of(), ids, omega))
        lines = page.locator(".js-plotly-plot .scatterlayer .trace")
        lines.nth(len(seeds) - 1).wait_for(state="attached")
        text = page.locator("body").inner_text()
    for run in seeds:
        assert f"{run.info.run_name} ({omega})" in text, "the legend names it"
        history = finished.results / f"train/scenenet/seed-{run.data.tags['seed']}/history.csv"
        path = [float(row[omega]) for row in rows_of(history)]
        assert f"{path[-1]!r}"[:8] in text, "the table below the plot has the last value"


def test_the_registry_shows_the_champions(store, pictures):
    with pictures.browsing() as page:
        page.goto(f"{store.address}/#/models")
        for name in ("scenenet", "scenenet-scenenet", "scenenet-cnn"):
            page.get_by_role("link", name=name, exact=True).first.wait_for()
        page.goto(f"{store.address}/#/models/scenenet")
        page.get_by_text("champion").first.wait_for()


def test_the_pictures_of_the_documentation_can_be_taken_again(finished, store, pictures, tmp_path):
    from PIL import Image

    pictures.take_page(finished.results / "report" / "index.html", tmp_path)
    pictures.take_experiments(store, tmp_path)
    pictures.take_runs(store, tmp_path)
    pictures.take_seeds(store, tmp_path)
    taken = sorted(tmp_path.glob("*.png"))
    assert len(taken) == 6
    for file in taken:
        assert 10_000 < file.stat().st_size < 300_000, file.name
        with Image.open(file) as picture:
            assert picture.width == pictures.WIDTH
            assert len(picture.convert("RGB").getcolors(1 << 20)) > 30, file.name
