"""Live image sources, and the worker thread that runs one."""
