"""What this extension adds to the program."""

from argparse import ArgumentParser

from lightpen.extension import Extension, Subcommand


def _add_simulate(parser: ArgumentParser) -> None:
    from lightpen_extensions.simulator.command import add_simulate

    add_simulate(parser)


SIMULATOR = Extension(
    "simulator",
    commands=(Subcommand("simulate", "write a simulated swing", _add_simulate),),
)
