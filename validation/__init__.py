"""Requirements, the tests that prove them, and the dossier of a release."""
