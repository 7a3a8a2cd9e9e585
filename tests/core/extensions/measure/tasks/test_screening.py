"""Points that are dropped at once: elsewhere, or in another posture."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.measure.tasks.drift import DRIFT
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint
from lightpen_extensions.measure.tasks.task import Screening, TaskProgress
from lightpen_extensions.simulator.swings import PAPER_CONE

ORIGIN = [0.0, 0.0, 0.0]


@pytest.fixture(scope="module")
def placed(instrument: Instrument) -> Callable[..., ProbedPoint]:
    """Return a function that makes a point off the cone, in a turned posture."""

    def point(off: list[float], turn: float = 0.0) -> ProbedPoint:
        R = rotation_from_vector(np.array([0.0, 0.0, turn]))
        shared = np.zeros((3, len(instrument.covariance)))
        return ProbedPoint(PAPER_CONE + off, np.eye(3), shared, R, ("image",), 0.0)

    return point


Placed = Callable[..., ProbedPoint]


def screened(
    task: str, points: list[ProbedPoint], runs: list[list[ProbedPoint]], by: Instrument
) -> Screening:
    progress = TaskProgress(tuple(points), tuple(map(tuple, runs)))
    if task == "drift":
        return DRIFT.screen(progress)
    return FIXED_POINT.screen(progress)


@pytest.mark.parametrize("task", ["drift", "fixed point"])
@pytest.mark.parametrize(
    ("off", "degrees", "codes"),
    [
        (0.199, 0.0, (None, None)),
        (0.201, 0.0, ("session.elsewhere", None)),
        (4.99, 0.0, ("session.elsewhere", None)),
        (5.01, 0.0, ("session.elsewhere",) * 2),
        (0.0, 11.9, (None, None)),
        (0.0, 12.1, ("session.other-than-first", None)),
    ],
)
def test_a_third_point_is_dropped_elsewhere_or_in_another_posture(
    instrument: Instrument,
    placed: Placed,
    task: str,
    off: float,
    degrees: float,
    codes: tuple[str | None, ...],
) -> None:
    last = placed([0.0, off, 0.0], turn=np.radians(degrees))
    found = screened(task, [placed(ORIGIN), placed(ORIGIN), last], [], instrument)

    code = codes[["drift", "fixed point"].index(task)]
    assert (None if found.fault is None else found.fault.code) == code
    assert len(found.kept) == (3 if code is None else 2)
    if code == "session.elsewhere":
        assert found.fault is not None
        assert found.fault.values["distance"] == pytest.approx(off)


@pytest.mark.parametrize(("off", "is_dropped"), [(4.99, False), (5.01, True)])
def test_of_two_points_of_a_reference_the_first_may_be_wrong_and_later_the_last(
    instrument: Instrument, placed: Placed, off: float, is_dropped: bool
) -> None:
    one, other = placed(ORIGIN), placed([off, 0.0, 0.0])
    first = screened("drift", [one, other], [], instrument)
    later = screened("drift", [one, other], [[one]], instrument)

    assert (list(first.kept), list(later.kept)) == (
        ([1], [0]) if is_dropped else ([0, 1], [0, 1])
    )


@pytest.mark.parametrize(("degrees", "is_new"), [(7.9, False), (8.1, True)])
def test_a_posture_is_another_one_from_eight_degrees_on(
    degrees: float, is_new: bool
) -> None:
    turn, _ = FIXED_POINT.newness
    assert (np.radians(degrees) >= turn) == is_new
