"""The result files of a run, and the tables that are made from them."""
