"""Widgets that pages and windows share; each shows one value."""
