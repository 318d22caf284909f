"""The claims of thesis chapter 5, each with a statistic, its interval over seeds and a verdict.

- ``claim``: a claim, and the rule of its verdict.
- ``intervals``: confidence intervals.
- ``evidence``: the results of a run by seed.
- ``of_models``, ``of_studies``: the claims, each defined once.
- ``table``: the tables of a run.
"""
