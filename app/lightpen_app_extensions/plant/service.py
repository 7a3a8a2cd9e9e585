"""Entries of the window, delivered to the server of the plant."""

from contextlib import suppress
from typing import TYPE_CHECKING

from lightpen.errors import FileError
from lightpen_app.face import Service
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.plant.extension import replicate

if TYPE_CHECKING:
    from lightpen.archive.store import Database
    from lightpen_extensions.plant.server import Replicator


class PlantService(Service):
    """Delivers the entries as soon as the server answers; History says how far."""

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        workbench.run.logbook.replicate_by(_replicate)


def _replicate(database: "Database", chain: str) -> "Replicator | None":
    with suppress(FileError):  # `Settings.fault` reports it
        return replicate(database, chain)
    return None
