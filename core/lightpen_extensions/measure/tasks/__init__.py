"""The verification tasks: from probed points to results with uncertainty."""
