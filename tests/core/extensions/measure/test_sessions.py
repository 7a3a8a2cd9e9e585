"""Sessions of simulated stations: what passes, and what is found.

``./run bench power`` has 300 sessions of each task.
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
from lightpen_extensions.measure.tasks.task import Found

N_STATIONS = 9
MIN_PASSED, MIN_FOUND = 0.95, 0.9
WRONG = 0.02  # mm
# Sessions at each station; the larger tasks take a fifth of a second.
N_EACH = {"tip check": 5, "drift": 5}
SHOWING_TIP = ["tip check"]
SHOWING_NO_TIP = ["ring, pen upright", "sphere", "length", "plane"]

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
