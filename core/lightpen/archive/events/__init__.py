"""The events of a data folder that are entered, taken from its files."""
