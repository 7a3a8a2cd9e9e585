"""Signatures of what a data folder holds: station key, supervisor key, signed texts."""
