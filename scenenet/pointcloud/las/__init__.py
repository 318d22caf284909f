"""LAS and LAZ files: headers, records, coordinate systems, safe decoding, writing."""
