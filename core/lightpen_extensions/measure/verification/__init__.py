"""Verification of a tip on artefacts; the state of pen and camera over time."""
