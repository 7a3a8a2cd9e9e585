"""Signatures in a data folder: station key, supervisor key, signed texts."""
