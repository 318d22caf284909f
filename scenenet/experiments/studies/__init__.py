"""The studies of thesis 5.2.7 and 5.3: many short trainings that differ in one setting.

- ``settings``: what a study varies.
- ``run``: its trainings and their scores.
- ``summary``: mean and spread over seeds, with the figures of the thesis.
- ``findings``: the result in a sentence or two.
"""
