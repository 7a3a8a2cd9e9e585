"""All extensions, put together here alone."""

from collections.abc import Sequence

from lightpen.cameras.sources import SOURCES
from lightpen.cli import main as run
from lightpen.commands.desktop import Desktop
from lightpen.extension import Extension
from lightpen.live.sources import Simulator
from lightpen_app.faced import Face, Faced
from lightpen_app_extensions.boards import BOARDS
from lightpen_app_extensions.comparisons import COMPARISONS
from lightpen_app_extensions.discover import DISCOVER
from lightpen_app_extensions.exports import EXPORTS
from lightpen_app_extensions.measure import MEASURE
from lightpen_app_extensions.plant import PLANT
from lightpen_app_extensions.report import REPORT
from lightpen_app_extensions.simulator import SIMULATOR
from lightpen_app_extensions.stream import STREAM
from lightpen_extensions.drivers.extension import DRIVERS

PARTS: tuple[Extension | Faced, ...] = (  # each after what it needs
    SIMULATOR,
    DRIVERS,
    COMPARISONS,
    MEASURE,
    BOARDS,
    DISCOVER,
    EXPORTS,
    PLANT,
    REPORT,
    STREAM,
)
EXTENSIONS = tuple(e.extension if isinstance(e, Faced) else e for e in PARTS)
SOURCES.extend(source for each in EXTENSIONS for source in each.sources)


def faces() -> tuple[Face, ...]:
    """Return what the extensions add to the window; imports Qt."""
    return tuple(each.load() for each in PARTS if isinstance(each, Faced))


def simulator() -> Simulator | None:
    """Return what simulates pen and cameras, if an extension does."""
    return next((e.load_simulator() for e in EXTENSIONS if e.load_simulator), None)


def main(arguments: Sequence[str] | None = None, desktop: Desktop | None = None) -> int:
    """Run the command line with all extensions; see `lightpen.cli.main`."""
    return run(arguments, desktop, EXTENSIONS)
