"""The steps of the wizard, a package each."""
