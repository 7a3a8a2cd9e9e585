"""From images to probed points: sources, drift reference, current tip."""
