"""Calibrating a camera, or two beside each other, by views of a board."""
