"""Runs workflow/Snakefile when snakemake is called in the root of the project."""


include: "workflow/Snakefile"


# Snakemake does not keep the default target of an included file.
workflow.default_target = "all"
