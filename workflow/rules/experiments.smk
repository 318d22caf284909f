"""What all experiments share: one table of the trainings of all jobs, and one of their times."""

# Experiment -> the tables of its jobs. A new experiment is a rule and an entry here.
RUNS = {name: every(name, "runs") for name in EXPERIMENTS}
RUN_TIMES = {name: every(name, "times") for name in EXPERIMENTS}


rule join_runs:
    input:
        runs=lambda w: RUNS[w.experiment],
        times=lambda w: RUN_TIMES[w.experiment],
    output:
        runs=in_report(
            f"{R}/{{experiment}}/runs.csv",
            "experiment-runs",
            lambda w: TABLE_TITLES[w.experiment][1],
            "Trainings",
            lambda w: {"table": f"{TABLE_TITLES[w.experiment][0]}, each training"},
        ),
        times=f"{R}/{{experiment}}/times.csv",
        provenance=f"{R}/{{experiment}}/provenance.json",
    log:
        f"{R}/logs/join_runs/{{experiment}}.log",
    benchmark:
        f"{R}/benchmarks/join_runs/{{experiment}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=500,
        runtime=5,
    params:
        job=job("join_runs", {}),
    message:
        "Joining the runs of the experiment {wildcards.experiment}"
    script:
        "../scripts/join_runs.py"
