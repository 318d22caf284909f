"""Predictions of surveys of many tiles, tile by tile: read, predict, search, write. With an observer of
wires, the lines are found after the towers.

A job knows its tile and the neighbours of that, so a new tile makes these again, and the list.
"""


rule voxel_size:
    input:
        model=champion_file(settings.predict.model),
    output:
        voxel_size=f"{R}/predict/voxel_size.json",
        provenance=f"{R}/predict/provenance.json",
    log:
        f"{R}/logs/voxel_size.log",
    benchmark:
        f"{R}/benchmarks/voxel_size.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job(
            "voxel_size",
            {"voxel_size": PREDICT["voxel_size"]},
            observers=observed_voxels(),
        ),
    message:
        "Looking up the voxel sizes of the models that predict"
    script:
        "../scripts/voxel_size.py"


rule read_tile:
    input:
        tile=lambda w: ancient(local(tile_of(w).path)),
        voxel_size=f"{R}/predict/voxel_size.json",
    output:
        work=f"{R}/predict/{{survey}}/work/{{tile}}.work",
    log:
        f"{R}/logs/read_tile/{{survey}}/{{tile}}.log",
    benchmark:
        f"{R}/benchmarks/read_tile/{{survey}}/{{tile}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    retries: 1
    group:
        together("read_tile")
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=megabytes(1000, 2),
        runtime=20,
    params:
        job=lambda w: job(
            "read_tile",
            {"chunk_points": PREDICT["chunk_points"]},
            name=tile_of(w).name,
            planned=tile_of(w).box,
            input={"tile": tile_of(w).known},
            **given_system(w.survey),
            **needs_classes(),
        ),
    message:
        "Reading tile {wildcards.tile} of {wildcards.survey}"
    script:
        "../scripts/read_tile.py"


if DENSITY:

    rule fullest_voxel:
        input:
            works=work_files("work"),
            model=champion_file(settings.predict.model),
        output:
            fullest=f"{R}/predict/{{survey}}/work/fullest.json",
        log:
            f"{R}/logs/fullest_voxel/{{survey}}.log",
        benchmark:
            f"{R}/benchmarks/fullest_voxel/{{survey}}.tsv"
        wildcard_constraints:
            survey=any_of(TILED),
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=2000,
            runtime=60,
        params:
            job=lambda w: job("fullest_voxel", {}, survey=PLANS[w.survey].survey.to_json()),
        message:
            "Counting the points in the fullest voxel of {wildcards.survey}"
        script:
            "../scripts/fullest_voxel.py"


rule predict_tile:
    input:
        work=f"{R}/predict/{{survey}}/work/{{tile}}.work",
        neighbours=lambda w: [
            f"{R}/predict/{w.survey}/work/{tile}.work" for tile in tile_of(w).neighbours
        ],
        model=champion_file(settings.predict.model),
        fullest=fullest_file,
    output:
        predictions=f"{R}/predict/{{survey}}/work/{{tile}}.predictions",
    log:
        f"{R}/logs/predict_tile/{{survey}}/{{tile}}.log",
    benchmark:
        f"{R}/benchmarks/predict_tile/{{survey}}/{{tile}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    retries: 1
    group:
        together("predict_tile")
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=megabytes(1500, 1),
        runtime=20,
    params:
        job=job("predict_tile", {"voxel_size": PREDICT["voxel_size"]}, within=NEIGHBOURS_M),
    message:
        "Predicting tile {wildcards.tile} of {wildcards.survey}"
    script:
        "../scripts/predict_tile.py"


rule observe_tile:
    input:
        work=f"{R}/predict/{{survey}}/work/{{tile}}.work",
        neighbours=lambda w: [
            f"{R}/predict/{w.survey}/work/{tile}.work" for tile in tile_of(w).neighbours
        ],
        model=f"{R}/models/{{observer}}.json",
        fullest=[],
    output:
        predictions=f"{R}/predict/{{survey}}/observed/{{observer}}/{{tile}}.predictions",
    log:
        f"{R}/logs/observe_tile/{{survey}}/{{observer}}/{{tile}}.log",
    benchmark:
        f"{R}/benchmarks/observe_tile/{{survey}}/{{observer}}/{{tile}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
        observer=any_of(settings.predict.observers),
    retries: 1
    group:
        together("observe_tile")
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=megabytes(1500, 1),
        runtime=20,
    params:
        job=job("predict_tile", {"voxel_size": PREDICT["voxel_size"]}, within=NEIGHBOURS_M),
    message:
        "Predicting tile {wildcards.tile} of {wildcards.survey} with {wildcards.observer}"
    script:
        "../scripts/predict_tile.py"


checkpoint find_towers:
    input:
        works=work_files("work"),
        predictions=work_files("predictions"),
        model=champion_file(settings.predict.model),
    output:
        towers=f"{R}/predict/{{survey}}/work/towers.json",
        near=directory(f"{R}/predict/{{survey}}/near"),
    log:
        f"{R}/logs/find_towers/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/find_towers/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    conda:
        "../envs/scenenet.yaml"
    threads: 2
    resources:
        mem_mb=megabytes(3000, 0.1),
        runtime=480,
    params:
        job=lambda w: job(
            "find_towers", SETTINGS["detection"], survey=PLANS[w.survey].survey.to_json()
        ),
    message:
        "Finding the towers of {wildcards.survey}"
    script:
        "../scripts/find_towers.py"


if settings.finds_lines():

    [WIRE_OBSERVER] = [
        observer.name
        for observer in settings.predicting_observers()
        if observer.finds.name == "wire"
    ]

    checkpoint conductors:
        input:
            works=work_files("work"),
            predictions=work_files("predictions"),
            wires=observed_tiles(WIRE_OBSERVER),
            towers=f"{R}/predict/{{survey}}/work/towers.json",
            decisions=rejecting,
        output:
            line=f"{R}/predict/{{survey}}/work/line.json",
            near=directory(f"{R}/predict/{{survey}}/near_line"),
        log:
            f"{R}/logs/conductors/{{survey}}.log",
        benchmark:
            f"{R}/benchmarks/conductors/{{survey}}.tsv"
        wildcard_constraints:
            survey=any_of(TILED),
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=megabytes(3000, 0.2),
            runtime=480,
        params:
            job=lambda w: job(
                "conductors",
                SETTINGS["detection"],
                survey=PLANS[w.survey].survey.to_json(),
                **rejects_of(w.survey),
            ),
        message:
            "Finding the spans and conductors of {wildcards.survey}"
        script:
            "../scripts/conductors.py"

    rule clearances:
        input:
            works=work_files("work"),
            wires=observed_tiles(WIRE_OBSERVER),
            line=f"{R}/predict/{{survey}}/work/line.json",
        output:
            clearances=f"{R}/predict/{{survey}}/work/clearances.json",
        log:
            f"{R}/logs/clearances/{{survey}}.log",
        benchmark:
            f"{R}/benchmarks/clearances/{{survey}}.tsv"
        wildcard_constraints:
            survey=any_of(TILED),
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=megabytes(3000, 0.1),
            runtime=480,
        params:
            job=lambda w: job(
                "clearances",
                SETTINGS["clearance"],
                survey=PLANS[w.survey].survey.to_json(),
                codes=SURVEYS[w.survey].codes,
            ),
        message:
            "Measuring the clearances of {wildcards.survey}"
        script:
            "../scripts/clearances.py"


# The towers and the conductors that reach into a tile are small files, which Snakemake compares by their
# content. They are not outputs of a rule, but within one: else each tile would be written again whenever
# towers are found.
rule write_tile:
    input:
        tile=lambda w: ancient(local(tile_of(w).path)),
        work=f"{R}/predict/{{survey}}/work/{{tile}}.work",
        predictions=[
            f"{R}/predict/{{survey}}/work/{{tile}}.predictions",
            *(
                f"{R}/predict/{{survey}}/observed/{name}/{{tile}}.predictions"
                for name in settings.predict.observers
            ),
        ],
        near=near_tile,
    output:
        points=f"{R}/predict/{{survey}}/{{survey}}/{{tile}}.laz",
        record=f"{R}/predict/{{survey}}/work/{{tile}}.written.json",
    log:
        f"{R}/logs/write_tile/{{survey}}/{{tile}}.log",
    benchmark:
        f"{R}/benchmarks/write_tile/{{survey}}/{{tile}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    retries: 1
    group:
        together("write_tile")
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=megabytes(1000, 2),
        runtime=20,
    params:
        job=lambda w: job(
            "write_tile",
            PREDICT,
            input={"tile": tile_of(w).known},
            **given_system(w.survey),
            **scheme_of(w.survey),
        ),
    message:
        "Writing tile {wildcards.tile} of {wildcards.survey}"
    script:
        "../scripts/write_tile.py"


rule survey_lists:
    input:
        works=work_files("work"),
        predictions=work_files("predictions"),
        observed=observed_by_all,
        towers=f"{R}/predict/{{survey}}/work/towers.json",
        line=of_line("line.json"),
        clearances=of_line("clearances.json"),
        points=lambda w: [
            f"{R}/predict/{w.survey}/{w.survey}/{t}.laz" for t in written_tiles(w.survey)
        ],
        written=lambda w: [
            f"{R}/predict/{w.survey}/work/{tile}.written.json" for tile in written_tiles(w.survey)
        ],
        model=champion_file(settings.predict.model),
        observers=observer_files(),
    output:
        **line_tables(),
        geopackage=f"{R}/predict/{{survey}}/{{survey}}.gpkg",
        geojson=in_report(
            f"{R}/predict/{{survey}}/{{survey}}.towers.geojson",
            "prediction-towers",
            "predictions",
            "Files",
            {"survey": "{survey}", "file": "Towers"},
        ),
        table=f"{R}/predict/{{survey}}/{{survey}}.towers.csv",
        summary=in_report(
            f"{R}/predict/{{survey}}/{{survey}}.summary.json",
            "prediction-summary",
            "predictions",
            "Files",
            {"survey": "{survey}", "file": "Summary"},
        ),
        page=f"{R}/predict/{{survey}}/{{survey}}.html",
        status=f"{R}/predict/{{survey}}/{{survey}}/status.csv",
        provenance=f"{R}/predict/{{survey}}/provenance.json",
    log:
        f"{R}/logs/survey_lists/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/survey_lists/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=megabytes(2000, 0.1),
        runtime=120,
    params:
        job=lambda w: job(
            "survey_lists",
            PREDICT,
            detection=SETTINGS["detection"],
            survey=PLANS[w.survey].survey.to_json(),
            input={"survey": [tile.known for tile in PLANS[w.survey].tiles.values()]},
            **classes_of(w.survey),
        ),
    message:
        "Writing the lists of {wildcards.survey}"
    script:
        "../scripts/survey_lists.py"


# It fails at the end where a tile is not predicted, so that the call of snakemake fails. Nothing
# depends on it: the report is complete, with these tiles in it.
rule survey_complete:
    input:
        summary=f"{R}/predict/{{survey}}/{{survey}}.summary.json",
        status=f"{R}/predict/{{survey}}/{{survey}}/status.csv",
    output:
        complete=f"{R}/predict/{{survey}}/complete.json",
    log:
        f"{R}/logs/survey_complete/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/survey_complete/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    priority: -1
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=500,
        runtime=5,
    params:
        job=job("survey_complete", {}),
    message:
        "Looking whether all tiles of {wildcards.survey} are predicted"
    script:
        "../scripts/survey_complete.py"


# Inside the job of a scheduler the process that runs a group takes its tiles itself, one after another. As jobs of
# the scheduler's own executor each of them would start Snakemake once more, which takes longer than a tile.
if workflow.remote_exec:

    localrules:
        read_tile,
        predict_tile,
        observe_tile,
        write_tile,
