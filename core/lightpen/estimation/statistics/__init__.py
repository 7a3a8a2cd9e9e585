"""Statistics of a fit: variance components, correlation, information, workers."""
