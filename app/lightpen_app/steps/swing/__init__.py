"""The step Swing: the pen swung in the cone, guided."""
