"""300 sessions of each verification task: what passes, what is found, what U covers."""

from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from benchmarks.rows import Row, numbers
from benchmarks.workers import Workers
from tests.simulated_sessions import (
    SESSIONS,
    SimulatedStation,
    any_direction,
    calibrated_station,
    drift_session,
    swings_of_pen,
)

from lightpen.archive.trends import TipEstimate
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.comparisons.pen_health import examine_pen
from lightpen_extensions.comparisons.repeatability import measure_repeatability
from lightpen_extensions.measure.tasks.drift import Drift

N_STATIONS = 300
MIN_PASSED, MIN_FOUND = 0.95, 0.95
TIP_PASSED = 0.97  # by the tip check
WRONG = 0.02, 0.05  # mm
TIP_CHECK = "tip check"  # which must find them
REFUSED = {Grade.CHECK, Grade.REPEAT}
N_DRIFTS = 10  # sessions at each station, for the coverage of U
COVERED = 0.93, 0.97
N_PENS, N_SWINGS = 45, 5
KNOCK = 0.05  # mm


class _Outcome(NamedTuple):
    """Outcomes of the sessions of a station.

    Attributes
    ----------
    grades : dict of str to list of Grade
        By task: of a correct tip, and of tips wrong by each of `WRONG`.
    drift_within : list of (3,) array of bool
        Whether U of a drift covers u, v and w.
    """

    grades: dict[str, list[Grade]]
    drift_within: list[list[bool]]


class _PenOutcome(NamedTuple):
    """Whether a healthy pen passed, and faults were found."""

    passed: bool
    knocked: bool
    repeats: bool


def session_rows(workers: Workers) -> list[Row]:
    """Return the shares of correct tips that pass and of wrong ones that are found."""
    outcomes = workers.map(_sessions, list(range(N_STATIONS)))
    rows = [_task_row(name, outcomes) for name in SESSIONS]
    within = np.mean([each for o in outcomes for each in o.drift_within], axis=0)
    low, high = COVERED
    rows.append(
        Row(
            f"{N_STATIONS * N_DRIFTS} drift references that stand still: within U "
            "along u v w",
            f"{numbers(100 * within, 1)} %",
            f"{100 * low:.0f} to {100 * high:.0f} %",
            met=bool(np.all((low <= within) & (within <= high))),
        )
    )
    return rows


def _task_row(name: str, outcomes: list[_Outcome]) -> Row:
    right, *wrong = zip(*(each.grades[name] for each in outcomes), strict=True)
    passed = _share(each not in REFUSED for each in right)
    found = [_share(each in REFUSED for each in grades) for grades in wrong]
    of_tip = _share(each is Grade.PASS for each in wrong[-1])
    is_tip_check = name == TIP_CHECK
    needed = TIP_PASSED if is_tip_check else MIN_PASSED
    sizes = " and ".join(f"{1000 * each:.0f}" for each in WRONG)
    least = f"{100 * MIN_FOUND:.0f} %" if is_tip_check else "-"
    return Row(
        f"{N_STATIONS} sessions, {name}: correct tips pass; tips wrong by {sizes} µm "
        "are found; the latter are called PASS",
        f"{100 * passed:.0f} %; {numbers(100 * np.array(found), 0)} %; "
        f"{100 * of_tip:.0f} %",
        f"{100 * needed:.0f} %; {least}; 0 %",
        met=passed >= needed
        and (not is_tip_check or min(found) >= MIN_FOUND)
        and not of_tip,
    )


def pen_rows(workers: Workers) -> list[Row]:
    """Return what ``verify pen`` and ``repeatability`` find of swings of a pen."""
    outcomes = workers.map(_pens, list(range(N_PENS)))
    shares = {
        f"pens of {N_SWINGS} swings: healthy ones pass": [o.passed for o in outcomes],
        "pens with an LED knocked by 0.05 mm: found": [o.knocked for o in outcomes],
        f"tips of {N_SWINGS} swings: repeatability passes": [
            o.repeats for o in outcomes
        ],
    }
    return [
        Row(
            f"{N_PENS} {what}",
            f"{100 * _share(reported):.0f} %",
            f"{100 * MIN_PASSED:.0f} %",
            met=_share(reported) >= MIN_PASSED,
        )
        for what, reported in shares.items()
    ]


def _share(reported: Iterable[bool]) -> float:
    return float(np.mean(list(reported)))


def _sessions(seed: int) -> _Outcome:
    rng = np.random.default_rng([25, seed])
    station = calibrated_station(rng)
    way = any_direction(rng)
    tips = [station, *(station.with_tip_moved(off * way) for off in WRONG)]
    grades = {
        name: [run(each, rng).assessment.grade for each in tips]
        for name, run in SESSIONS.items()
    }
    return _Outcome(grades, [_drift_within(station, rng) for _ in range(N_DRIFTS)])


def _drift_within(station: SimulatedStation, rng: np.random.Generator) -> list[bool]:
    found = drift_session(station, rng)
    assert isinstance(found, Drift)
    within = np.abs(found.moves[-1]) <= found.uncertainties[-1]
    return [bool(each) for each in within]


def _pens(seed: int) -> _PenOutcome:
    rng = np.random.default_rng([26, seed])
    leds = calibrated_station(rng).instrument.pen.leds
    with TemporaryDirectory() as folder:
        swings, knocked = swings_of_pen(rng, N_SWINGS, Path(folder), KNOCK)
    healthy = examine_pen(swings, leds)
    of_knocked = examine_pen([*swings, knocked], leds)
    tips = [TipEstimate(s.path.name, s.tip_pen, s.uncertainty, s.when) for s in swings]
    repeated = measure_repeatability(tips, VerificationLimits())
    return _PenOutcome(
        healthy.assessment.is_accepted,
        of_knocked.assessment.grade is Grade.REPEAT,
        repeated.assessment.is_accepted,
    )
