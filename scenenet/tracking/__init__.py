"""Every training as a run in MLflow."""

from scenenet.tracking.model_runs import model_groups
from scenenet.tracking.run_log import RunGroup, RunRecord, log_runs
from scenenet.tracking.store import TrackingSettings, create_store, experiment_of, store_id

__all__ = [
    "RunGroup",
    "RunRecord",
    "TrackingSettings",
    "create_store",
    "experiment_of",
    "log_runs",
    "model_groups",
    "store_id",
]
