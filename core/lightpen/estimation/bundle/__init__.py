"""Bundle adjustment of all unknowns, with priors from files."""
