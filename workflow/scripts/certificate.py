"""Work out which promises of a GENEO a model keeps."""

import adapter


def certificate(job: adapter.Job) -> None:
    from scenenet.core.files import write_json
    from scenenet.interpretability.certificate import certificate

    write_json(job.output.certificate, certificate(job.input.model))


adapter.run(certificate)
