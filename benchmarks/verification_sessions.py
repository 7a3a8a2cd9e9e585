"""45 sessions of each verification task: what passes, and what is found."""

from typing import NamedTuple

import numpy as np
from benchmarks.rows import Row
from benchmarks.workers import Workers
from tests.simulated_sessions import SESSIONS, any_direction, calibrated_station

from lightpen.estimation.reports.verdict import Grade
from lightpen.verification.tasks.task import Found

N_STATIONS = 45
MIN_PASSED, MIN_FOUND = 0.95, 0.9
WRONG = 0.02  # mm
SHOWING_TIP = ("fixed point", "articulation")  # with default settings


class _Outcome(NamedTuple):
    """Whether a correct tip passed, and a wrong one was found, by task."""

    passed: dict[str, bool]
    found: dict[str, bool]


def session_rows(workers: Workers) -> list[Row]:
    """Return the shares of correct tips that pass and of wrong ones that are found."""
    outcomes = workers.map(_sessions, list(range(N_STATIONS)))
    rows = []
    for name in SESSIONS:
        passed = float(np.mean([each.passed[name] for each in outcomes]))
        found = float(np.mean([each.found[name] for each in outcomes]))
        claims = name in SHOWING_TIP
        rows.append(
            Row(
                f"{N_STATIONS} sessions, {name}: correct tips pass, tips wrong by "
                f"{1000 * WRONG:.0f} µm are found",
                f"{100 * passed:.0f} %, {100 * found:.0f} %",
                f"{100 * MIN_PASSED:.0f} %, "
                + (f"{100 * MIN_FOUND:.0f} %" if claims else "not claimed"),
                met=passed >= MIN_PASSED and (found >= MIN_FOUND or not claims),
            )
        )
    return rows


def _sessions(seed: int) -> _Outcome:
    rng = np.random.default_rng([25, seed])
    station = calibrated_station(rng)
    wrong = station.with_tip_moved(WRONG * any_direction(rng))

    def passes(found: Found) -> bool:
        return found.assessment.grade is Grade.PASS

    return _Outcome(
        {name: passes(run(station, rng)) for name, run in SESSIONS.items()},
        {name: not passes(run(wrong, rng)) for name, run in SESSIONS.items()},
    )
