"""What this extension adds to the program."""

from lightpen.extension import Extension, Subcommand

MEASURE = Extension(
    "measure",
    commands=(
        Subcommand(
            "verify",
            "verify a tip on reference artefacts",
            "lightpen_extensions.measure.commands.measure:add_verify",
        ),
        Subcommand(
            "measure",
            "measure a part by a plan",
            "lightpen_extensions.measure.commands.measure:add_measure",
        ),
    ),
)
