"""Work out which promises of a GENEO a model keeps."""

import adapter


def certificate(job: adapter.Job) -> None:
    from scenenet.certificates import certificate
    from scenenet.files import write_json

    write_json(job.output.certificate, certificate(job.input.model))


adapter.run(certificate)
