"""The step Verify: verification of the current tip on reference artefacts."""
