"""Accepted results: files, acceptance, assessment against the current tip."""
