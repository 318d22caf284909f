"""The configuration of the workflow: schema, errors, reference, survey sheet."""
