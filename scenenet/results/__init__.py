"""What a run left in its result folder, and the tables that are made from it."""
