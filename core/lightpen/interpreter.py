"""Start and end of the Python interpreter."""

import gc
import os
from collections.abc import Callable

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
