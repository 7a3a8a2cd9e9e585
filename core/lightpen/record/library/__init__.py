"""The asset register of pens, tips and cones, and supervision of limits."""
