"""Sessions of simulated stations: what passes, and what is found.

``./run bench power`` has 45 sessions of each task, at 45 stations.
"""

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
from lightpen.verification.tasks.circle import Circle
from lightpen.verification.tasks.task import Found

N_STATIONS = 9
MIN_PASSED, MIN_FOUND = 0.95, 0.9
WRONG = 0.02  # mm
# Sessions at each station; the larger tasks take a fifth of a second.
N_EACH = {"fixed point": 5, "drift": 5}
SHOWING_TIP = ["fixed point"]
SHOWING_NO_TIP = ["ring, upright", "length"]

Stations: TypeAlias = tuple[SimulatedStation, ...]


@pytest.fixture(scope="module")
def stations() -> Stations:
    rng = np.random.default_rng(25)
    return tuple(calibrated_station(rng) for _ in range(N_STATIONS))


@pytest.mark.slow
@pytest.mark.parametrize("name", SESSIONS)
def test_a_correct_tip_passes(stations: Stations, name: str) -> None:
    found = [each.assessment for each in _all(stations, name, lambda each, _: each)]

    # One of 18 may fail, where 45 are too many for a test.
    wanted = max(MIN_PASSED * len(found) - 1, 0)
    assert sum(each.is_accepted for each in found) >= wanted, found


@pytest.mark.slow
@pytest.mark.parametrize("name", SHOWING_TIP)
def test_a_tip_that_is_wrong_by_20_um_is_found_where_its_postures_show_it(
    stations: Stations, name: str
) -> None:
    found = _all(
        stations,
        name,
        lambda each, rng: each.with_tip_moved(WRONG * any_direction(rng)),
    )

    assert np.mean([each.assessment.grade is not Grade.PASS for each in found]) >= (
        MIN_FOUND
    )


def test_a_ring_in_many_postures_finds_the_tip_error_that_it_claims_to_find(
    stations: Stations,
) -> None:
    name, rng = "ring, turned", np.random.default_rng(2)
    found = []
    for station in stations:
        ring = SESSIONS[name](station, rng)
        assert isinstance(ring, Circle)
        claimed = ring.tip.detectable
        assert claimed < 0.05
        wrong = station.with_tip_moved(claimed * any_direction(rng))
        found.append(SESSIONS[name](wrong, rng).assessment.grade)

    assert np.mean([grade is not Grade.PASS for grade in found]) >= MIN_FOUND - 0.1


@pytest.mark.parametrize("name", SHOWING_NO_TIP)
def test_a_task_that_shows_no_tip_error_does_not_verify_the_tip(
    stations: Stations, name: str
) -> None:
    for found in _all(stations[:1], name, lambda each, _: each):
        assert found.assessment.grade is not Grade.PASS
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
        for _ in range(N_EACH.get(name, 2))
    ]
