"""Cameras of makers and standards, by their libraries."""
