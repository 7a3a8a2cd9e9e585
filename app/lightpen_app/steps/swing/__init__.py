"""The step Swing: a guided swing of the pen in the cone."""
