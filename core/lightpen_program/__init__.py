"""The program: the calibration and all its extensions, put together here alone."""

from collections.abc import Sequence

from lightpen.cli import main as run
from lightpen.commands.desktop import Desktop
from lightpen.extension import Extension
from lightpen_extensions.boards.extension import BOARDS
from lightpen_extensions.discover.extension import DISCOVER
from lightpen_extensions.exports.extension import EXPORTS
from lightpen_extensions.measure.extension import MEASURE
from lightpen_extensions.plant.extension import PLANT
from lightpen_extensions.simulator.extension import SIMULATOR
from lightpen_extensions.stream.extension import STREAM

EXTENSIONS: tuple[Extension, ...] = (
    SIMULATOR,
    MEASURE,
    DISCOVER,
    BOARDS,
    EXPORTS,
    PLANT,
    STREAM,
)


def main(arguments: Sequence[str] | None = None, desktop: Desktop | None = None) -> int:
    """Run the command line with all extensions; see `lightpen.cli.main`."""
    return run(arguments, desktop, EXTENSIONS)
