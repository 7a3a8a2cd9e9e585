"""Threads that own long procedures: serial queue, background tasks, faults."""
