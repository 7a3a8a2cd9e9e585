"""What this extension adds to the program."""

from argparse import ArgumentParser

from lightpen.extension import Extension, Subcommand


def _add_verify(parser: ArgumentParser) -> None:
    from lightpen_extensions.measure.commands.measure import add_verify

    add_verify(parser)


def _add_measure(parser: ArgumentParser) -> None:
    from lightpen_extensions.measure.commands.measure import add_measure

    add_measure(parser)


MEASURE = Extension(
    "measure",
    commands=(
        Subcommand("verify", "verify a tip on reference artefacts", _add_verify),
        Subcommand("measure", "measure a part by a plan", _add_measure),
    ),
)
