"""Verifications in the data folder: a file for each task that was done, never changed.

Each is what the command of its kind writes, and can be given to whatever reads that. It
says besides who verified what in which session. Those of simulated pens are kept apart.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from lightpen.formats.hashes import InputFile
from lightpen.formats.json_records import file_entry, record_bytes
from lightpen.model.origin import Origin
from lightpen.record.folder_archive import SIMULATED
from lightpen.record.numbered_files import add_numbered
from lightpen.record.verifications import VERIFICATIONS
from lightpen.verification.articulation import Articulation
from lightpen.verification.choices import TaskKind, VerificationChoices
from lightpen.verification.circle import Circle
from lightpen.verification.drift import Drift
from lightpen.verification.fixed_point import FixedPoint
from lightpen.verification.places import Viewers
from lightpen.verification.records import (
    articulation_entries,
    circle_entries,
    drift_entries,
    fixed_point_entries,
    length_entries,
    rejected_entries,
    verification_record,
)
from lightpen.verification.session_state import Found
from lightpen.verification.tip_in_force import TipInForce
from lightpen.verification.touch import RejectedFrame
from lightpen.verification.touch_images import TouchRecord
from lightpen.verification.witness import LampWitness, witness_entries

LIMITS = {
    TaskKind.FIXED_POINT: ("across", "along"),
    TaskKind.CIRCLE: ("radius", "form"),
    TaskKind.LENGTH: ("length",),
    TaskKind.ARTICULATION: ("location",),
    TaskKind.DRIFT: ("drift",),
}


@dataclass(frozen=True)
class TouchedImages:
    """Where the images of a task come from.

    Attributes
    ----------
    origin : Origin or None
        What they are of; None where a record does not say.
    files : tuple of InputFile
        Of a live camera those through which the pen was held still: each by its
        number, with the hash of its pixels.
    rejected : tuple of RejectedFrame
        Those that belong to no touch, and why.
    witness : LampWitness or None
        What fixed lamps in view tell so far.
    records : tuple of TouchRecord
        Where those of a live camera are kept, run by run.
    """

    origin: Origin | None
    files: tuple[InputFile, ...] = ()
    rejected: tuple[RejectedFrame, ...] = ()
    witness: LampWitness | None = None
    records: tuple[TouchRecord, ...] = ()


def keep_verification(
    data: Path, record: Mapping[str, Any], *, is_simulated: bool
) -> Path:
    """Keep the record of a verification in a data folder, and return its file.

    Raises
    ------
    FileError
        It cannot be written.
    """
    folder = verifications_folder(data, is_simulated=is_simulated)
    return add_numbered(folder, record_bytes(record))


def verifications_folder(data: Path, *, is_simulated: bool) -> Path:
    """Return the folder of a data folder that verifications are kept in."""
    return (data / SIMULATED if is_simulated else data) / VERIFICATIONS


def task_record(
    task: TaskKind,
    found: Found,
    tip: TipInForce,
    choices: VerificationChoices,
    session: datetime,
    images: TouchedImages,
) -> dict[str, Any]:
    """Return the record of a task.

    Parameters
    ----------
    session : datetime
        When the verification began that it is part of.
    """
    names, limits = tip.names, asdict(choices.limits)
    return verification_record(
        str(task),
        {
            "session": session.isoformat(timespec="seconds"),
            "station": names.station,
            "operator": names.operator,
            "pen": names.pen,
            "tip": names.tip,
            "origin": images.origin,
            **_entries(found, tip),
            "rejected": rejected_entries(images.rejected),
            "witness": witness_entries(images.witness),
        },
        found.assessment,
        {name: limits[name] for name in LIMITS[task]},
        {
            "tip": file_entry(tip.tip_file),
            **viewer_entries(tip.viewers),
            "pen": file_entry(tip.pen_file),
            "images": [file_entry(file) for file in images.files],
            "touches": [
                {"folder": each.folder.name, "journal_sha256": each.journal.sha256}
                for each in images.records
            ],
        },
    )


def viewer_entries(viewers: Viewers) -> dict[str, Any]:
    """Return the files of cameras, as inputs of a record."""
    first, *others = (file_entry(file) for file in viewers.files)
    if not others:
        return {"camera": first}
    return {"camera": others[0], "rig": first, "cameras": others}


def _entries(found: Found, tip: TipInForce) -> dict[str, Any]:
    if isinstance(found, FixedPoint):
        return fixed_point_entries(found, tip.instrument)
    if isinstance(found, Circle):
        return circle_entries(found, tip.instrument)
    if isinstance(found, Articulation):
        return articulation_entries(found)
    if isinstance(found, Drift):
        return drift_entries(found)
    return length_entries(found, tip.instrument)
