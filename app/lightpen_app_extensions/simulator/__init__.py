"""The demo, in which a simulated operator uses the window."""
