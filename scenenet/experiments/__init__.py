"""Experiments: many trainings that differ in one thing, and what they show.

- ``cross_validation``: every crop is left out once.
- ``components``: rules alone, models alone, and both.
- ``label_noise``: training on labels of which a known share is wrong (thesis 5.2.5).
- ``studies``: the studies and ablations of thesis 5.2.7 and 5.3.
- ``wires_at_towers``: wires that a model finds at synthetic towers.
- ``domain_gap``: synthetic crops compared with real ones.
"""
