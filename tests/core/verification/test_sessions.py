"""Sessions of simulated stations: what passes, and what is found.

45 sessions of each task at 9 stations; ``./run bench power`` has 45 stations.
"""

from collections import Counter
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pytest
from tests.simulated_sessions import (
    SESSIONS,
    SimulatedStation,
    any_direction,
    calibrated_station,
)

from lightpen.estimation.reports.verdict import Grade
from lightpen.verification.tasks.task import Found

N_STATIONS, N_EACH = 9, 5
MIN_PASSED, MIN_FOUND = 43, 41  # of 45: 95 % and 90 %
WRONG = 0.02  # mm
SHOWING_TIP = ["fixed point", "articulation", "ring, turned"]
SHOWING_NO_TIP = ["ring, upright", "length", "plane"]

Stations: TypeAlias = tuple[SimulatedStation, ...]


@pytest.fixture(scope="module")
def stations() -> Stations:
    rng = np.random.default_rng(25)
    return tuple(calibrated_station(rng) for _ in range(N_STATIONS))


@pytest.mark.parametrize("name", SESSIONS)
def test_a_correct_tip_passes(stations: Stations, name: str) -> None:
    grades = Counter(
        found.assessment.grade for found in _all(stations, name, lambda each, _: each)
    )

    assert grades[Grade.PASS] >= MIN_PASSED, grades


@pytest.mark.parametrize("name", SHOWING_TIP)
def test_a_tip_that_is_wrong_by_20_um_is_found_where_its_postures_show_it(
    stations: Stations, name: str
) -> None:
    found = _all(
        stations,
        name,
        lambda each, rng: each.with_tip_moved(WRONG * any_direction(rng)),
    )

    n_found = sum(each.assessment.grade is not Grade.PASS for each in found)
    assert n_found >= MIN_FOUND


@pytest.mark.parametrize("name", SHOWING_NO_TIP)
def test_a_task_that_shows_no_tip_error_does_not_verify_the_tip(
    stations: Stations, name: str
) -> None:
    for found in _all(stations[:1], name, lambda each, _: each):
        if found.assessment.grade is Grade.PASS:
            assert "not the tip" in str(found.assessment.reason)
            assert "use the tip" not in str(found.assessment.next_step)


def _all(
    stations: Stations,
    name: str,
    changed: Callable[[SimulatedStation, np.random.Generator], SimulatedStation],
) -> list[Found]:
    rng = np.random.default_rng(1)
    return [
        SESSIONS[name](changed(station, rng), rng)
        for station in stations
        for _ in range(N_EACH)
    ]
