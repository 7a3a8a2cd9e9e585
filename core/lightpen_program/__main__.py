"""Start of the command line."""

import sys

from lightpen.interpreter import run_program


def main() -> int:
    """Run the command line and return the exit status."""

    def command_line() -> int:
        from lightpen_program import main as run

        return run()

    return run_program(command_line)


if __name__ == "__main__":
    sys.exit(main())
