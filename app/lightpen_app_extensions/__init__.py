"""Extensions in the window: what those of `lightpen_extensions` show, one each."""
