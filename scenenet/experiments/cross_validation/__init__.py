"""Cross-validation: every crop is left out once."""
