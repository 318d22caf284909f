"""The content of a survey and its defects.

- ``check``: one pass over the points.
- ``cell_counts``: counts of points per cell and of duplicates, in bounded memory.
- ``report``: facts, class densities and warnings, as text and JSON.
"""
