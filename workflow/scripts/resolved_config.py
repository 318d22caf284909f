"""Write down all settings of the run, defaults included."""

import adapter


def resolved_config(job: adapter.Job) -> None:
    from scenenet.core.provenance import write_settings

    write_settings(job.output.config, job.settings)


adapter.run(resolved_config)
