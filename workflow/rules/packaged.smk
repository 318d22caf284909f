"""The models that come with the package, each with its card: the best seed of the model that predicts,
and the first observer of wires."""

packaged = settings.model_named(settings.predict.model)

if packaged.kind == "scenenet" and packaged.protocol == "operational":

    rule packaged_model:
        input:
            model=champion_file(packaged.name),
            scores=every("evaluate", "scores", model=packaged.name),
            tunings=every("tune", "tuning", model=packaged.name),
            histories=every("train", "history", model=packaged.name),
            records=every("train", "provenance", model=packaged.name),
            split=every("split", "split"),
        output:
            model=f"{R}/packaged/towers.json",
            card=f"{R}/packaged/towers.md",
            provenance=f"{R}/packaged/provenance.json",
        log:
            f"{R}/logs/packaged_model.log",
        benchmark:
            f"{R}/benchmarks/packaged_model.tsv"
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=1000,
            runtime=10,
        params:
            job=job(
                "packaged_model",
                {},
                results=results_of(models=[packaged], predicts=packaged.name),
            ),
        message:
            "Writing the chosen model and its card ({output.card})"
        script:
            "../scripts/packaged_model.py"


WIRES = [observer.name for observer in settings.observers if observer.finds.name == "wire"]

if WIRES:

    rule packaged_wires:
        input:
            model=f"{R}/models/{WIRES[0]}.json",
            scores=every("evaluate_observer", "scores", observer=WIRES[:1]),
            tunings=every("tune_observer", "tuning", observer=WIRES[:1]),
            split=f"{R}/square_split/{WIRES[0]}/split.csv",
        output:
            model=f"{R}/packaged/wires.json",
            card=f"{R}/packaged/wires.md",
            provenance=f"{R}/packaged/wires.provenance.json",
        log:
            f"{R}/logs/packaged_wires.log",
        benchmark:
            f"{R}/benchmarks/packaged_wires.tsv"
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=1000,
            runtime=10,
        params:
            job=job(
                "packaged_wires",
                {},
                results=results_of(models=[], observers=WIRES[:1]),
            ),
        message:
            "Writing the observer of wires and its card ({output.card})"
        script:
            "../scripts/packaged_wires.py"
