"""Widgets that several steps share; each shows one value."""
