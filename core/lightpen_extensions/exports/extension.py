"""What this extension adds to the program."""

from lightpen.extension import Extension, Subcommand

EXPORTS = Extension(
    "exports",
    commands=(
        Subcommand(
            "export",
            "export a tip for other programs",
            "lightpen_extensions.exports.command:add_export",
        ),
    ),
)
