"""Write all settings of the run to a file, defaults included."""

import _job


def resolved_config(job: _job.Job) -> None:
    from scenenet.core.provenance import write_settings

    write_settings(job.output.config, job.settings)


_job.run(resolved_config)
