"""Foundations that every other package uses.

- ``errors``: the one error that users see.
- ``settings``: the base class of all settings.
- ``files``: outputs that are written whole or not at all, JSON, digests.
- ``unchanged``: whether a file is still the one that was read before.
- ``progress``: progress of long work on stderr.
- ``provenance``: fingerprints of inputs, the record of what made a result.
- ``code_hash``: a digest of the code behind a result.
- ``extras``: optional dependencies.
- ``compilation``: how numba compiles the loops.
- ``peak_memory``: memory that the process has used.
"""
