"""How far synthetic crops are from real ones, and what that costs a model."""
