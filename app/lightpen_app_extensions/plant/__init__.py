"""The server of a plant in the window."""
