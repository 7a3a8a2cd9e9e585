"""What this extension adds to the program."""

from typing import TYPE_CHECKING

from lightpen.extension import Extension, Subcommand

if TYPE_CHECKING:
    from lightpen_extensions.simulator.simulator import SceneSimulator


def _load_simulator() -> "SceneSimulator":
    from lightpen_extensions.simulator.simulator import SceneSimulator

    return SceneSimulator()


SIMULATOR = Extension(
    "simulator",
    commands=(
        Subcommand(
            "simulate",
            "write a simulated swing",
            "lightpen_extensions.simulator.command:add_simulate",
        ),
    ),
    load_simulator=_load_simulator,
)
