"""The live stream in the window."""
