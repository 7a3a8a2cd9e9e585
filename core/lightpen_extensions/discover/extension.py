"""What this extension adds to the program."""

from lightpen.extension import Extension, Subcommand

DISCOVER = Extension(
    "discover",
    commands=(
        Subcommand(
            "discover",
            "find tip, pen and camera from one swing and one length",
            "lightpen_extensions.discover.command:add_discover",
        ),
    ),
)
