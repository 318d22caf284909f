"""LAS, LAZ and COPC files.

- ``header``: the header, checked against the size of the file.
- ``chunk_table``: the table of compressed chunks, checked before decoding.
- ``records``: the points, in chunks.
- ``isolation``, ``decoder``: decompression in a separate process.
- ``crs``: the coordinate reference system and unit.
- ``extra_dimensions``: which dimensions and values LAS can store.
- ``writing``: a point cloud as a new file.
"""
