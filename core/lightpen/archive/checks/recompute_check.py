"""Check of accepted tips by recomputation from the LED centres in their records.

Hashes and signatures show that a result is unchanged since its entry, not that it was
right: the holder of the station key may enter any tip. To be believed, a forged tip
would need forged LED centres that give it.
"""

import random
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from lightpen.archive.chains.chains import chain_at_home, entries_of
from lightpen.archive.chains.entries import Kind, StoredEntry
from lightpen.archive.checks.check import ArchiveCheckResult
from lightpen.archive.checks.files_check import file_finding
from lightpen.archive.store.database import Database
from lightpen.errors import ArchiveError, CalibrationError, LightpenError
from lightpen.estimation.reports.methods import result_of
from lightpen.messages import Message, message
from lightpen.record.calibrations.calibrations import read_calibration
from lightpen.record.calibrations.recomputing import recompute

SAMPLE = 3  # tips, by default
TOLERANCE = 0.1  # of U, by which another version of the program may differ


def with_recomputed(
    checked: ArchiveCheckResult,
    database: Database,
    data: Path,
    n_tips: int | None = SAMPLE,
    report: Callable[[float], None] = lambda fraction: None,
) -> ArchiveCheckResult:
    """Recompute accepted tips of a data folder; return the check with the differences.

    ``n_tips`` are chosen at random; None for all. For ``report`` see `check_archive`.
    """
    home, tips = chain_at_home(database), list[StoredEntry]()
    if home is not None and n_tips != 0:
        with suppress(ArchiveError):  # a damaged entry, which the check found
            for each in entries_of(database, home):
                tips += [each] if _is_recorded(each, data) else []
    if n_tips is not None and n_tips < len(tips):
        tips = random.SystemRandom().sample(tips, n_tips)
    findings, notes = [], []
    for i, entry in enumerate(tips, start=1):
        try:
            finding = _difference(entry, data)
        except LightpenError as error:
            number = entry.entry.number
            notes.append(
                message("archive.not-recomputed", number=number, why=error.message)
            )
        else:
            findings += [] if finding is None else [finding]
        report(i / len(tips))
    return replace(
        checked,
        n_tips=len(tips) - len(notes),
        findings=(*checked.findings, *findings),
        notes=(*checked.notes, *notes),
    )


def _is_recorded(entry: StoredEntry, data: Path) -> bool:
    """Return whether an entry accepts a tip whose file has not changed since."""
    event = entry.entry.event
    if event.kind is not Kind.ACCEPTED or event.result is None:
        return False
    return file_finding(data, entry.entry.number, event.result) is None


def _difference(entry: StoredEntry, data: Path) -> Message | None:
    event, number = entry.entry.event, entry.entry.number
    assert event.result is not None
    file = data / event.result.place
    stated = read_calibration(file)
    try:
        again = recompute(file)
    except CalibrationError as error:
        return message("archive.no-tip-again", number=number, why=error.message)
    found = result_of(again.calibration, again.method)
    U = found.expanded_uncertainty[:3]
    off = np.abs(found.tip_pen - stated.tip_pen)
    if (np.maximum(off, np.abs(U - stated.uncertainty)) <= TOLERANCE * U).all():
        return None
    return message(
        "archive.other-tip-again",
        number=number,
        distance=float(np.linalg.norm(off)),
        uncertainty=float(U.max()),
        stated=float(stated.uncertainty.max()),
        program=event.program,
    )
