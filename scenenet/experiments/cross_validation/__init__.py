"""Cross-validation: every crop is a test crop once (thesis 5.2.4)."""
