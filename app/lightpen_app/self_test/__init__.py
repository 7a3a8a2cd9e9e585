"""``lightpen --self-test REPORT.json``: the program tries itself where it is."""
