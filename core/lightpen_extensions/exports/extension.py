"""What this extension adds to the program."""

from argparse import ArgumentParser

from lightpen.extension import Extension, Subcommand


def _add_export(parser: ArgumentParser) -> None:
    from lightpen_extensions.exports.command import add_export

    add_export(parser)


EXPORTS = Extension(
    "exports",
    commands=(Subcommand("export", "export a tip for other programs", _add_export),),
)
