"""Verify which properties of a GENEO a model has."""

import _job


def certificate(job: _job.Job) -> None:
    from scenenet.core.files import write_json
    from scenenet.interpretability.certificate import certificate

    write_json(job.output.certificate, certificate(job.input.model).to_json())


_job.run(certificate)
