"""Start of the program: its window, its demo, or a command."""

import os
import sys


def main() -> int:
    """Run the program and return the exit status."""
    # Before numpy is imported: the matrices are many and small; threads would only
    # wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from lightpen.cli import main as run

    return run(show_window=_show_window)


def _show_window(plays_demo: bool) -> int:
    # Commands start faster without the window's libraries.
    from lightpen.formats.decoding import keep_freed_memory
    from lightpen_app.application import run, run_demo
    from lightpen_app.wizard_pages import make_pages

    keep_freed_memory()
    return run_demo(make_pages) if plays_demo else run(make_pages)


if __name__ == "__main__":
    sys.exit(main())
