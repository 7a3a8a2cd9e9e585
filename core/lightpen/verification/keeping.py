"""Verifications in the data folder: a file for each task that was done, never changed.

Each is what the command of its kind writes, and can be given to whatever reads that. It
says besides who verified what in which session. Those of simulated pens are kept apart.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from lightpen.estimation.report import record_bytes
from lightpen.estimation.verdict import Grade
from lightpen.formats.hashes import InputFile
from lightpen.model.origin import Origin
from lightpen.record.folder_archive import SIMULATED
from lightpen.record.numbered_files import add_numbered
from lightpen.record.outcome import TrialOutcome
from lightpen.record.verifications import VERIFICATIONS
from lightpen.verification.choices import TaskKind, VerificationChoices
from lightpen.verification.circle import Circle
from lightpen.verification.fixed_point import FixedPoint
from lightpen.verification.records import (
    circle_entries,
    fixed_point_entries,
    length_entries,
    rejected_entries,
    verification_record,
)
from lightpen.verification.session import Found
from lightpen.verification.tip_in_force import TipInForce
from lightpen.verification.touch import RejectedFrame
from lightpen.verification.witness import LampWitness, witness_entries

LIMITS = {
    TaskKind.FIXED_POINT: ("across", "along"),
    TaskKind.CIRCLE: ("radius", "form"),
    TaskKind.LENGTH: ("length",),
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
    """

    origin: Origin | None
    files: tuple[InputFile, ...] = ()
    rejected: tuple[RejectedFrame, ...] = ()
    witness: LampWitness | None = None


@dataclass(frozen=True)
class VerificationAcceptance:
    """Why a tip is used though something was found against it.

    Attributes
    ----------
    supervisor : str
        Empty where it took none.
    """

    grade: Grade
    reason: str
    supervisor: str
    at: datetime


def keep_verification(
    data: Path, record: Mapping[str, Any], *, is_simulated: bool
) -> Path:
    """Keep the record of a verification in a data folder, and return its file.

    Raises
    ------
    FileError
        It cannot be written.
    """
    root = data / SIMULATED if is_simulated else data
    return add_numbered(root / VERIFICATIONS, record_bytes(record))


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
            "tip": _entry(tip.tip_file),
            "camera": _entry(tip.camera_file),
            "pen": _entry(tip.pen_file),
            "images": [_entry(file) for file in images.files],
        },
    )


def acceptance_record(
    tip: TipInForce,
    session: datetime,
    files: tuple[InputFile, ...],
    acceptance: VerificationAcceptance,
) -> dict[str, Any]:
    """Return the record of a tip that is used though its verification is no pass.

    Parameters
    ----------
    files : tuple of InputFile
        Of the verification.
    """
    names = tip.names
    return {
        "program": {"name": "lightpen", "version": version("lightpen")},
        "created": acceptance.at.isoformat(timespec="seconds"),
        "verification": "acceptance",
        "session": session.isoformat(timespec="seconds"),
        "station": names.station,
        "operator": names.operator,
        "pen": names.pen,
        "tip": names.tip,
        "grade": acceptance.grade.value,
        "supervisor": acceptance.supervisor,
        "reason": acceptance.reason,
        "accepts": [_entry(file) for file in files],
    }


def abandoned_record(
    tip: TipInForce, session: datetime, n_touches: int, now: datetime
) -> dict[str, Any]:
    """Return the record of a verification that was left before it was done.

    Parameters
    ----------
    n_touches : int
        Of the task that was at hand; what was done before it has records of its own.
    """
    names = tip.names
    return {
        "program": {"name": "lightpen", "version": version("lightpen")},
        "created": now.isoformat(timespec="seconds"),
        "verification": TrialOutcome.ABANDONED.value,
        "session": session.isoformat(timespec="seconds"),
        "station": names.station,
        "operator": names.operator,
        "pen": names.pen,
        "tip": names.tip,
        "origin": tip.origin,
        "touches": n_touches,
        "inputs": {
            "tip": _entry(tip.tip_file),
            "camera": _entry(tip.camera_file),
            "pen": _entry(tip.pen_file),
        },
    }


def _entries(found: Found, tip: TipInForce) -> dict[str, Any]:
    if isinstance(found, FixedPoint):
        return fixed_point_entries(found, tip.instrument)
    if isinstance(found, Circle):
        return circle_entries(found, tip.instrument)
    return length_entries(found, tip.instrument)


def _entry(file: InputFile) -> dict[str, str]:
    return {"file": file.path.name, "sha256": file.sha256}
