"""What this extension adds to the program."""

from argparse import ArgumentParser

from lightpen.extension import Extension, Subcommand


def _add_intrinsics(parser: ArgumentParser) -> None:
    from lightpen_extensions.boards.command import add_intrinsics

    add_intrinsics(parser)


def _add_extrinsics(parser: ArgumentParser) -> None:
    from lightpen_extensions.boards.command import add_extrinsics

    add_extrinsics(parser)


BOARDS = Extension(
    "boards",
    commands=(
        Subcommand("intrinsics", "calibrate a camera with a board", _add_intrinsics),
        Subcommand(
            "extrinsics",
            "calibrate the extrinsics of two cameras with a board",
            _add_extrinsics,
        ),
    ),
)
