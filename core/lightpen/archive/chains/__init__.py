"""Chains of signed entries, each with the hash of the one before."""
