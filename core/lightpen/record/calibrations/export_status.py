"""Status, date and due date of an exported tip."""

from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from lightpen.errors import FileError
from lightpen.estimation.reports.verdict import Grade
from lightpen.local_time import local_time
from lightpen.model.limits import StationLimits
from lightpen.model.origin import Origin
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.calibrations.traceability import traced_items
from lightpen.record.library.tip_library import ItemKind
from lightpen.record.results.opening import data_folder_of
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.swings.header import Header
from lightpen.record.swings.reading import open_record

RETIRED, OVERDUE = "RETIRED", "OVERDUE"
NOT_ENTERED = "NOT ENTERED"  # in the archive


def with_status(file: CalibrationFile, now: datetime) -> CalibrationFile:
    """Return a calibration with the status of its pen and tip in the data folder."""
    data = data_folder_of(file.path)
    if data is None:
        return file
    results, names = FolderArchive(data), file.names
    library, today = results.library(), local_time(now).date()
    listed = (
        library.item(ItemKind.PEN, names.pen),
        library.item(ItemKind.TIP, names.tip),
    )
    items = [item for item in listed if item is not None]
    usual = results.supervision().limits_at(names.station, StationLimits()).due
    due = library.rule_of(names.tip, usual).due(file.calibration.created)
    found = []
    if any(item.is_retired for item in items):
        found.append(RETIRED)
    if now > due or any(item.is_overdue(today) for item in items):
        found.append(OVERDUE)
    header = _header(data, file)
    serials = () if header is None else _serials(header)
    return replace(
        file,
        measured=None if header is None else header.created,
        traced=traced_items(library, names, serials),
        library_status=tuple(found),
        due=local_time(due).date(),
    )


def _header(data: Path, file: CalibrationFile) -> Header | None:
    """Return the header of the swing of a calibration; None where it is not there."""
    if file.swing is not None:
        with suppress(FileError):
            return open_record(data / file.swing).header
    return None


def _serials(header: Header) -> tuple[str, ...]:
    """Return the serial numbers of the cameras of a swing, the first one first."""
    names, settings = ("camera_serial", "second_camera_serial"), header.settings
    return tuple(str(settings[name]) for name in names if name in settings)


def status_of(file: CalibrationFile) -> tuple[str, ...]:
    """Return the status words of a tip, empty if it is valid."""
    own = []
    if file.origin is Origin.SIMULATED:
        own.append(Origin.SIMULATED.upper())
    if file.grade is not Grade.PASS:
        own.append(file.grade.value.upper())
    if file.is_entered is False:
        own.append(NOT_ENTERED)
    return (*own, *file.library_status)
