"""Verifications on disk: records, images of probed points, resuming."""
