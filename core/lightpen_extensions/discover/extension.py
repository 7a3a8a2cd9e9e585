"""What this extension adds to the program."""

from argparse import ArgumentParser

from lightpen.extension import Extension, Subcommand


def _add_discover(parser: ArgumentParser) -> None:
    from lightpen_extensions.discover.command import add_discover

    add_discover(parser)


DISCOVER = Extension(
    "discover",
    commands=(
        Subcommand(
            "discover",
            "find tip, pen and camera from one swing and one length",
            _add_discover,
        ),
    ),
)
