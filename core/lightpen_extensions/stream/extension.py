"""What this extension adds to the program."""

from argparse import ArgumentParser

from lightpen.extension import Extension, Subcommand


def _add_stream(parser: ArgumentParser) -> None:
    from lightpen_extensions.stream.command import add_stream

    add_stream(parser)


STREAM = Extension(
    "stream",
    commands=(
        Subcommand("stream", "stream pose and tip to other programs", _add_stream),
    ),
)
