"""Extensions of the program, one package each; they lean on `lightpen` alone."""
