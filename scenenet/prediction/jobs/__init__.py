"""The stages of a survey of many files as jobs: each reads files of others and writes its own.

``predict_survey`` and ``predict_to_files`` run the same stages in one process. Here a stage does
not know the whole survey: a file is predicted with its neighbours alone, and written with the
towers that reach into it. The first stage is ``work_file.read_file``.
"""
