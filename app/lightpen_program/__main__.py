"""Start of the program: window, demo, self-test or command."""

import gc
import os
import sys
from collections.abc import Callable
from pathlib import Path

SELF_TEST = "--self-test"


class Launchers:
    """Starts window, demo and self-test; imports each when needed.

    Commands start faster without the window's libraries.
    """

    def show_window(self, swing: Path | None) -> int:
        """Open the window, at a recorded swing if a path leads to one."""
        from lightpen.formats.decoding import keep_freed_memory
        from lightpen_app.application import run
        from lightpen_program.extensions import faces, simulator

        keep_freed_memory()
        return run(faces(), simulator(), swing)

    def play_demo(self) -> int:
        """Play a calibration with a simulated operator."""
        from lightpen.formats.decoding import keep_freed_memory
        from lightpen_app.application import required
        from lightpen_program.extensions import faces, simulator

        simulated = required(simulator())
        from lightpen_app_extensions.simulator.demo import run_demo

        keep_freed_memory()
        return run_demo(faces(), simulated)

    def test_itself(self, report: Path) -> int:
        """Test the installation and write a report."""
        from lightpen_program.self_test import test_program

        return test_program(report)

    def data_folder(self) -> Path:
        """Return the chosen folder of records, results and archive."""
        from lightpen_app.work.settings import Settings, data_folder, settings_file

        return data_folder(Settings(settings_file()).preferences())


def main() -> int:
    """Run the program and return the exit status."""
    return run_program(_run)


def _run() -> int:
    if len(sys.argv) == 3 and sys.argv[1] == SELF_TEST:
        # Names a damaged file, also one that all commands need.
        return Launchers().test_itself(Path(sys.argv[2]))
    from lightpen_program.extensions import main as run

    return run(desktop=Launchers())


# Of objects that may be garbage, more than are imported. A search looks through all
# that is there, and imports would bring a search at every 700 objects.
SEARCH_AFTER = 100_000


def run_program(program: Callable[[], int]) -> int:
    """Run a program that imports numpy only now, and return its exit status."""
    # The matrices are many and small; threads would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(SEARCH_AFTER)
    status = program()
    gc.freeze()  # spares a search when the process ends
    return status


if __name__ == "__main__":
    sys.exit(main())
