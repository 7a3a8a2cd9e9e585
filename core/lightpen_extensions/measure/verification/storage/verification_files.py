"""Verifications in the data folder: a file for each task that was done, never changed.

Each has the format that the command of its kind writes, with operator, item and session
in addition. Files of simulated pens are kept apart.
"""

from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime
from typing import Any

from lightpen.comparisons.records import verification_record
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.json_records import file_entry
from lightpen.record.folder.verifications import conditions_entries
from lightpen_extensions.measure.verification.probing.current_tip import CurrentTip
from lightpen_extensions.measure.verification.probing.drift_reference import (
    LampDrift,
    lamp_drift_entries,
)
from lightpen_extensions.measure.verification.probing.image_locations import PenCameras
from lightpen_extensions.measure.verification.session.choices import VerificationChoices
from lightpen_extensions.measure.verification.storage.point_images import PointRecord
from lightpen_extensions.measure.verification.tasks.registry import AnyTask
from lightpen_extensions.measure.verification.tasks.task import Found


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


def viewer_entries(viewers: PenCameras) -> dict[str, Any]:
    """Return the files of cameras, as inputs of a record."""
    first, *others = (file_entry(file) for file in viewers.files)
    if not others:
        return {"camera": first}
    return {"camera": others[0], "rig": first, "cameras": others}
