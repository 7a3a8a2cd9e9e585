"""Assessment of a solved swing beside the current result."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import date
from itertools import chain

import numpy as np

from lightpen.errors import AcceptanceError, FileError
from lightpen.estimation.reports.methods import reported
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.estimation.reports.verdict import (
    Change,
    Verdict,
    change_doubt,
    change_since,
    distance_from_nominal,
    judge,
    judge_change,
    judge_unknown,
    repeats,
)
from lightpen.local_time import local_time
from lightpen.messages import Message, message
from lightpen.model.coverage import dial_counts
from lightpen.model.limits import StationLimits, SwingLimits
from lightpen.model.origin import Origin
from lightpen.record.library.tip_library import KIND_WORDS, SWUNG, ItemKind, Library
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.names import Names
from lightpen.record.swings.reading import (
    Record,
    is_of_recording,
    recorded_limits,
    recorded_names,
    recorded_origin,
)
from lightpen.record.swings.solving import Solution
from lightpen.swing_messages import Code, too_little_tilt


@dataclass(frozen=True, eq=False)
class SwingAssessment:
    """Assessment of a solved swing."""

    verdict: Verdict
    last: Result | None  # of this pen and tip; None if none can be read
    change: Change | None
    doubts: tuple[Message, ...]  # besides the verdict, the worst first
    max_change: float | None = None  # limit of the tip, mm, if it has one
    limits: SwingLimits = field(default_factory=SwingLimits)
    names: Names = field(default_factory=Names)  # as the library or `last` spells them


def assess(
    archive: FolderArchive, record: Record, solution: Solution
) -> SwingAssessment:
    """Judge a solved swing by itself and beside the current result."""
    names, origin = recorded_names(record), recorded_origin(record)
    limits, limit, last, unknown = recorded_limits(record), None, None, None
    library = Library()
    try:
        limits = _limits_in_force(archive, names, limits)
        library = archive.library()
        listed = library.tip(names.tip)
        limit = None if listed is None else listed.max_change_mm
        is_simulated = origin is Origin.SIMULATED
        last = archive.in_force(names.pen, names.tip, is_simulated=is_simulated)
    except (FileError, AcceptanceError) as error:
        unknown = error.message
    verdict, found = judge(solution.calibration, limits), reported(solution.calibration)
    if unknown is not None:
        verdict = judge_unknown(verdict, unknown)
    change, doubt = None, None
    if last is not None:
        date = f"{local_time(last.accepted):%Y-%m-%d}"
        change = change_since(
            found.tip_pen,
            found.expanded_uncertainty[:3],
            last.tip_pen,
            last.uncertainty,
        )
        doubt = change_doubt(change, date, limit)
        verdict = judge_change(verdict, change, date, limit)
    all_doubts = chain(
        [] if unknown is None else [message(Code.LAST_UNKNOWN, why=unknown)],
        [] if doubt is None else [doubt],
        overdue_items(library, names, local_time(record.header.created).date()),
        _far_from_nominal(solution),
        _bare_sides(solution, limits) if is_of_recording(record) else [],
        warnings_of(solution.calibration),
    )
    doubts = tuple(each for each in all_doubts if not repeats(each, verdict.reason))
    return SwingAssessment(
        verdict, last, change, doubts, limit, limits, _spelled(names, library, last)
    )


def _spelled(names: Names, library: Library, last: Result | None) -> Names:
    """Return names as the library spells them, or else the current result."""
    before = names if last is None else last.names
    pen, tip, cone = (
        library.item(kind, name)
        for kind, name in zip(SWUNG, (names.pen, names.tip, names.cone), strict=True)
    )
    return replace(
        names,
        pen=before.pen if pen is None else pen.id,
        tip=before.tip if tip is None else tip.id,
        cone=names.cone if cone is None else cone.id,
    )


def _limits_in_force(
    archive: FolderArchive, names: Names, recorded: SwingLimits
) -> SwingLimits:
    """Return the limits set for a station now; without any, those of the swing.

    Those of the swing are in a file that anybody can edit, and may be older.
    """
    chosen = StationLimits(swing=recorded)
    now = archive.supervision().limits_at(names.station, chosen).swing
    return replace(now, spacing=recorded.spacing, min_per_field=recorded.min_per_field)


def overdue_items(library: Library, names: Names, day: date) -> Iterator[Message]:
    """Return the items that were overdue on the day of the swing."""
    for item in (
        library.item(ItemKind.PEN, names.pen),
        library.item(ItemKind.TIP, names.tip),
        library.item(ItemKind.CONE, names.cone),
    ):
        if item is not None and item.is_overdue(day):
            yield message(
                "doubt.overdue",
                kind=KIND_WORDS[item.kind],
                id=item.id,
                due=str(item.due),
            )


def _far_from_nominal(solution: Solution) -> list[Message]:
    nominal = solution.source.pen.nominal_tip
    distance = distance_from_nominal(reported(solution.calibration).tip_pen, nominal)
    if distance is None:
        return []
    return [message("doubt.far-from-nominal", distance=distance)]


def _bare_sides(solution: Solution, limits: SwingLimits) -> list[Message]:
    """Return the directions without images in recorded swings."""
    counts = dial_counts(solution.calibration.joint.rotations)[1:].sum(axis=0)
    bare = np.flatnonzero(counts == 0)
    if not (len(bare) and limits.min_per_field):
        return []
    return [too_little_tilt(limits.min_per_field * len(bare), map(int, bare))]
