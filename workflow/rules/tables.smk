"""The tables of thesis chapter 5, with the thesis' numbers beside this run's."""


rule tables:
    input:
        dataset=every("dataset_tables", "tables"),
        checks=every("check", "classes", survey=TRAIN),
        towers=[*every("towers", "towers"), *every("towers", "true_towers")],
        crops=every("crops", "manifest"),
        voxelisation_time=every("voxelisation_time", "times"),
        split=every("split", "split"),
        trainings=every("train", "history"),
        records=every("train", "provenance"),
        resources=every("train", "resources"),
        tunings=every("tune", "tuning"),
        models=every("tune", "model"),
        scores=every("evaluate", "scores"),
        observers=[
            *every("tune_observer", "model"),
            *every("evaluate_observer", "scores"),
            *of_boosted_trees("scores", "observer_trees"),
        ],
        studies=[*every("join_study", "runs"), *every("join_study", "times")],
        experiments=[*every("join_runs", "runs"), *every("join_runs", "times")],
        boosted_trees=[*of_boosted_trees("scores"), *of_boosted_trees("times")],
        certificates=every("certificate", "certificate"),
        inference_time=every("inference_time", "times"),
        thesis=ancient(own_file(settings.thesis)),
    output:
        tables=[table_in_report(f"{R}/tables/{name}.csv") for name in table_names()],
        comparisons=[table_in_report(f"{R}/tables/{name}.csv") for name in COMPARISONS],
        scores=f"{R}/tables/scores.json",
        provenance=f"{R}/tables/provenance.json",
    log:
        f"{R}/logs/tables.log",
    benchmark:
        f"{R}/benchmarks/tables.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job(
            "tables",
            {},
            results=results_of(
                studies=VALUES["study"],
                experiments=EXPERIMENTS,
                observers=VALUES["observer"],
            ),
            input=THESIS,
        ),
    message:
        "Writing the tables"
    script:
        "../scripts/tables.py"
