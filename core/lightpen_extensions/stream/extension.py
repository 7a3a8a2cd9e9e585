"""What this extension adds to the program."""

from lightpen.extension import Extension, Subcommand

STREAM = Extension(
    "stream",
    commands=(
        Subcommand(
            "stream",
            "stream pose and tip to other programs",
            "lightpen_extensions.stream.command:add_stream",
        ),
    ),
)
