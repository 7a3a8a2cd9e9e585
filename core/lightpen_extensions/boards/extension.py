"""What this extension adds to the program."""

from lightpen.extension import Extension, Subcommand

BOARDS = Extension(
    "boards",
    commands=(
        Subcommand(
            "intrinsics",
            "calibrate a camera with a board",
            "lightpen_extensions.boards.command:add_intrinsics",
        ),
        Subcommand(
            "extrinsics",
            "calibrate the extrinsics of two cameras with a board",
            "lightpen_extensions.boards.command:add_extrinsics",
        ),
    ),
)
