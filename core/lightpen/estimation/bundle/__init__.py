"""Bundle adjustment of all that the images depend on, with priors from files."""
