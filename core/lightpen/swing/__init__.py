"""A swing: the choices for it, its capture, and the workflow up to acceptance."""
