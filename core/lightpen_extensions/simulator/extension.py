"""What this extension adds to the program."""

from argparse import ArgumentParser
from typing import TYPE_CHECKING

from lightpen.extension import Extension, Subcommand

if TYPE_CHECKING:
    from lightpen_extensions.simulator.simulator import SceneSimulator


def _add_simulate(parser: ArgumentParser) -> None:
    from lightpen_extensions.simulator.command import add_simulate

    add_simulate(parser)


def _load_simulator() -> "SceneSimulator":
    from lightpen_extensions.simulator.simulator import SceneSimulator

    return SceneSimulator()


SIMULATOR = Extension(
    "simulator",
    commands=(Subcommand("simulate", "write a simulated swing", _add_simulate),),
    load_simulator=_load_simulator,
)
