"""Verifications in the data folder: a file for each task that was done, never changed.

Each has the format that the command of its kind writes, with operator, item and session
in addition. Files of simulated pens are kept apart.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.json_records import file_entry, record_bytes
from lightpen.record.folder.verifications import VERIFICATIONS
from lightpen.record.library.entered_files import add_numbered
from lightpen.record.library.signing.keys import SigningKey
from lightpen.record.results.result_folder import SIMULATED
from lightpen.verification.probing.current_tip import CurrentTip
from lightpen.verification.probing.drift_reference import LampDrift, lamp_drift_entries
from lightpen.verification.probing.image_locations import PenCameras
from lightpen.verification.reports.records import verification_record
from lightpen.verification.session.choices import VerificationChoices
from lightpen.verification.storage.point_images import PointRecord
from lightpen.verification.tasks.registry import AnyTask
from lightpen.verification.tasks.task import Found


def keep_verification(
    data: Path,
    record: Mapping[str, Any],
    supervisor: SigningKey | None = None,
    *,
    is_simulated: bool,
) -> Path:
    """Keep the record of a verification in a data folder, and return its file.

    The supervisor whom it names approves it.
    """
    folder = verifications_folder(data, is_simulated=is_simulated)
    return add_numbered(data, folder, record_bytes(record), supervisor)


def verifications_folder(data: Path, *, is_simulated: bool) -> Path:
    """Return the verifications folder of a data folder."""
    return (data / SIMULATED if is_simulated else data) / VERIFICATIONS


def task_record(
    task: AnyTask,
    found: Found,
    tip: CurrentTip,
    choices: VerificationChoices,
    session: datetime,
    lamp_drift: LampDrift | None,
    records: Sequence[PointRecord],
) -> dict[str, Any]:
    """Return the record of the task of a verification that began at ``session``.

    ``records`` has the images of its points, one a run.
    """
    names, limits = tip.names, asdict(choices.limits)
    return verification_record(
        task.kind,
        {
            "session": session.isoformat(timespec="seconds"),
            "station": names.station,
            "operator": names.operator,
            "pen": names.pen,
            "tip": names.tip,
            "origin": tip.origin,
            "camera_serials": camera_serials(tip.instrument),
            "remarks": list(tip.instrument.remarks),
            **conditions_entries(tip.temperature_c, tip.humidity_percent),
            **task.entries(found, tip.instrument),
            "rejected": [],
            "witness": lamp_drift_entries(lamp_drift),
        },
        found.assessment,
        {name: limits[name] for name in task.limits},
        {
            "tip": file_entry(tip.tip_file),
            **viewer_entries(tip.viewers),
            "pen": file_entry(tip.pen_file),
            "images": [],
            "touches": [
                {"folder": each.folder.name, "journal_sha256": each.journal.sha256}
                for each in records
            ],
        },
        task.rule_of(choices.options_of(task), choices.limits),
    )


def camera_serials(instrument: Instrument) -> list[str]:
    """Return the serial number of each camera, as an entry of a record."""
    return [each.serial for each in instrument.rig.cameras]


def conditions_entries(
    temperature_c: float | None, humidity_percent: float | None
) -> dict[str, float]:
    """Return the measured environment as entries of a record."""
    conditions = {"temperature_c": temperature_c, "humidity_percent": humidity_percent}
    return {name: each for name, each in conditions.items() if each is not None}


def viewer_entries(viewers: PenCameras) -> dict[str, Any]:
    """Return the files of cameras, as inputs of a record."""
    first, *others = (file_entry(file) for file in viewers.files)
    if not others:
        return {"camera": first}
    return {"camera": others[0], "rig": first, "cameras": others}
