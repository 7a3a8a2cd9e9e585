"""A swing as it happens: its states and rules, and where to lean the pen next."""
