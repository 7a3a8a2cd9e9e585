"""``lightpen --self-test REPORT.json``: tests an installation."""
