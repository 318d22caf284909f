"""Copy the model of wires, and write its card."""

import _job
import _results


def packaged_wires(job: _job.Job) -> None:
    from scenenet.results.observer_card import write_observer_card

    results = _results.results_of(job)
    [name] = results.observers
    files = job.input.split, job.input.model, job.output.model, job.output.card
    write_observer_card(results, name, *files)


_job.run(packaged_wires)
