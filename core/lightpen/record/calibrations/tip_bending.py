"""The bending of a calibrated tip: by the press test in its library, or assumed."""

from datetime import datetime
from pathlib import Path

from msgspec import structs

from lightpen.local_time import local_now
from lightpen.model.bending import ASSUMED_BENDING, Bending, MeasuredBending
from lightpen.model.origin import Origin
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.tip_library import Library, ListedTip, read_library
from lightpen.record.results.opening import data_folder_of


def bending_of(calibration: CalibrationFile, data: Path | None = None) -> Bending:
    """Return the bending of a tip today.

    By the library of a data folder, by default that of the result. The library knows
    no simulated tip.
    """
    data = data or data_folder_of(calibration.path)
    if data is None or calibration.origin is Origin.SIMULATED:
        return ASSUMED_BENDING
    return read_library(data).bending_of(calibration.names.tip, local_now().date())


def keep_bending(
    data: Path, tip: str, bending: MeasuredBending, by: Author, now: datetime
) -> Library:
    """Store a press test with its tip in the library; see `add_item`."""
    listed = read_library(data).tips.get(tip)
    if listed is None:
        return add_item(data, ListedTip(id=tip, bending=bending), by, now)
    return change_item(data, structs.replace(listed, bending=bending), by, now, listed)
