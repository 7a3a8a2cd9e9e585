"""The step Verify: the tip in force proven by touching what is known."""
