"""Start of the command line, with what must be set before numpy is imported."""

import os
import sys


def main() -> int:
    """Run the command line and return the exit status."""
    # The matrices are many and small; threads would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from lightpen.cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
