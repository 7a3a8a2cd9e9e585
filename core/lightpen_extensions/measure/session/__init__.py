"""A verification session: its state, its rules and guidance."""
