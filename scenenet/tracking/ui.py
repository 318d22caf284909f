"""The MLflow user interface: serving it, and the addresses of its comparisons."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from urllib.parse import quote, urlencode

from scenenet.core.errors import InputError

HOST = "127.0.0.1"
START_LIMIT_S = 120.0
"""Longest time, s, until MLflow must respond; on a busy machine it takes half a minute."""


@contextlib.contextmanager
def serving(uri: str) -> Iterator[str]:
    """Serve the store at ``uri`` on a free port of this machine for as long as the block lasts.

    Yields:
        the address of the start page.

    Raises:
        InputError: MLflow stopped or did not respond in time; with its last line of output.
    """
    port = _free_port()
    address = f"http://{HOST}:{port}"
    command = [sys.executable, "-m", "mlflow", "server", "--backend-store-uri", uri,
               "--host", HOST, "--port", str(port), "--workers", "1"]  # fmt: skip
    # Without its runners of jobs, eight processes that only generative models need.
    without = {"MLFLOW_DISABLE_TELEMETRY": "true", "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false"}
    environment = {**os.environ, **without}
    with tempfile.TemporaryFile() as log:
        # In its own session, because it starts processes that must be stopped with it.
        process = subprocess.Popen(
            command, stdout=log, stderr=log, env=environment, start_new_session=True
        )
        try:
            if not _responds(f"{address}/health", process):
                log.seek(0)
                last = log.read().decode(errors="replace").strip().splitlines()[-1:]
                raise InputError(f"MLflow does not serve {uri} ({''.join(last)})")
            yield address
        finally:
            _stop(process)


def comparison(address: str, experiment: str, runs: Sequence[str]) -> str:
    """The page that compares runs, given by their ids."""
    query = {"runs": json.dumps(list(runs)), "experiments": json.dumps([experiment])}
    return f"{address}/#/compare-runs?{urlencode(query, quote_via=quote)}"


def metric_over_steps(address: str, experiment: str, runs: Sequence[str], metric: str) -> str:
    """The page that draws one metric of several runs over the epochs."""
    query = {
        "runs": json.dumps(list(runs)),
        "metric": json.dumps(metric),
        "experiments": json.dumps([experiment]),
        "plot_metric_keys": json.dumps([metric]),
        "plot_layout": json.dumps({"autosize": True}),
        "x_axis": "step",
        "y_axis_scale": "linear",
        "line_smoothness": "1",
        "show_point": "false",
        "deselected_curves": "[]",
        "last_linear_y_axis_range": "[]",
    }
    return f"{address}/#/metric?{urlencode(query, quote_via=quote)}"


def experiment_runs(address: str, experiment: str) -> str:
    """The table of the runs of an experiment."""
    return f"{address}/#/experiments/{experiment}/runs"


def _free_port() -> int:
    with socket.socket() as taken:
        taken.bind((HOST, 0))
        return int(taken.getsockname()[1])


def _responds(address: str, process: subprocess.Popen[bytes]) -> bool:
    """Whether it responds before it stops and before the time limit."""
    # Without the proxy of the environment: the server is on this machine.
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    until = time.monotonic() + START_LIMIT_S
    while time.monotonic() < until and process.poll() is None:
        try:
            with opener.open(address, timeout=5):
                return True
        except (urllib.error.URLError, OSError):
            time.sleep(0.2)
    return False


def _stop(process: subprocess.Popen[bytes]) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGTERM)
    try:
        process.wait(15)
    except subprocess.TimeoutExpired:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
