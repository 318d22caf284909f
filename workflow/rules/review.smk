"""What people decide about the towers of new surveys: a list to fill in, and the reviewed towers."""


rule review_template:
    input:
        **tower_list("{survey}"),
    output:
        template=f"{R}/review/{{survey}}/{{survey}}.template.csv",
    log:
        f"{R}/logs/review_template/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/review_template/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(NEW),
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job("review_template", {}),
    message:
        "Writing a review file of {wildcards.survey} to fill in"
    script:
        "../scripts/review_template.py"


# A review file is known by its content, as a survey is.
rule review:
    input:
        **tower_list("{survey}"),
        decisions=lambda w: [ancient(local(path)) for path in REVIEWS[w.survey]],
    output:
        table=f"{R}/review/{{survey}}/{{survey}}.reviewed.csv",
        geojson=f"{R}/review/{{survey}}/{{survey}}.reviewed.geojson",
        geopackage=f"{R}/review/{{survey}}/{{survey}}.reviewed.gpkg",
        rejected=f"{R}/review/{{survey}}/{{survey}}.rejected.csv",
        record=f"{R}/review/{{survey}}/{{survey}}.reviewed.json",
        provenance=f"{R}/review/{{survey}}/provenance.json",
    log:
        f"{R}/logs/review/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/review/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(REVIEWS),
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=lambda w: job(
            "review", {}, input={"decisions": [content_of(path) for path in REVIEWS[w.survey]]}
        ),
    message:
        "Merging what people decided about the towers of {wildcards.survey}"
    script:
        "../scripts/review.py"
