"""Geometric features of parts by probed points, with their uncertainty."""
