"""The window about the steps: bars, list of steps, help, options."""
