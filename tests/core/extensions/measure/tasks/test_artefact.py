"""Artefacts: a plan with a certified value, the paper's Table 3, the pen's scale."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.artefacts import Artefact, ArtefactKind, Side
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.measure.measuring.plan import are_of_second_end, artefact_plan
from lightpen_extensions.measure.measuring.plan_checks import problems_of
from lightpen_extensions.measure.tasks.part import Part, sizes_of
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint
from lightpen_extensions.measure.tasks.registry import measure_artefacts, size_table
from lightpen_extensions.measure.tasks.task import Conditions
from lightpen_extensions.simulator.swings import PAPER_CONE, PAPER_TIP

Touching = Callable[..., tuple[ProbedPoint, ...]]
RING = Artefact(ArtefactKind.RING, 31.751, 0.001)
BAR = Artefact(ArtefactKind.LENGTH, 150.0, 0.001)
HALF = np.array([75.0, 0.0, 0.0])
START, END = PAPER_CONE - HALF, PAPER_CONE + HALF


def measured(
    artefact: Artefact, conditions: Conditions, *runs: tuple[ProbedPoint, ...]
) -> Part:
    named = [(f"{i}", points) for i, points in enumerate(runs)]
    return measure_artefacts("", len(runs) * [artefact], named, conditions)


@pytest.mark.parametrize("kind", ArtefactKind)
def test_the_plan_of_an_artefact_is_valid_and_has_its_certified_value(
    kind: ArtefactKind,
) -> None:
    plan = artefact_plan("Artefact", 2 * [Artefact(kind, 20.0, 0.002)])

    assert not list(problems_of(plan))
    sizes = [e for e in plan.characteristics if e.nominal == 20.0]
    assert [each.certified for each in sizes] == [0.002, 0.002]


def test_a_size_grows_with_the_temperature_which_counts_in_its_uncertainty() -> None:
    warm = replace_heat(BAR, 24.0, 11.5)
    size, known = warm.size()

    assert size == pytest.approx(150.0 * (1 + 4 * 11.5e-6))
    per_kelvin = 150.0 * 11.5e-6
    assert known == pytest.approx(np.linalg.norm([0.001, per_kelvin, 0.4 * per_kelvin]))


def replace_heat(artefact: Artefact, temperature: float, expansion: float) -> Artefact:
    return Artefact(
        artefact.kind,
        artefact.certified,
        artefact.uncertainty,
        temperature=temperature,
        expansion=expansion,
    )


def test_rings_are_measured_within_their_uncertainty_beside_each_other(
    instrument: Instrument, touching: Touching, ring: Callable[..., FloatArray]
) -> None:
    runs = [touching(ring(), seed=seed) for seed in range(12)]
    found = measured(RING, Conditions(instrument), *runs)

    sizes = sizes_of(found.part)
    within = [abs(e.deviation or 0.0) <= e.value.uncertainty for e in sizes]
    assert sum(within) >= 10
    assert found.assessment.grade is Grade.SCALE
    table = size_table(found)
    assert len(table.columns) == len(table.rows[1].values) == 12 + 2
    errors = [each.deviation for each in sizes]
    assert table.rows[1].values[:12] == pytest.approx(errors)
    assert table.rows[1].values[12] == pytest.approx(np.mean(np.array(errors)))


@pytest.mark.parametrize(
    ("off", "code"), [(0.015, "artefact.good"), (0.03, "artefact.off")]
)
def test_a_certified_value_that_is_not_kept_is_reported(
    instrument: Instrument,
    touching: Touching,
    ring: Callable[..., FloatArray],
    off: float,
    code: str,
) -> None:
    other = Artefact(ArtefactKind.RING, 31.751 + off, 0.001)
    found = measured(other, Conditions(instrument), touching(ring()))

    assert found.assessment.reason.code == code
    assert found.assessment.reason.values["limit"] == pytest.approx(0.02)
    passes = Grade.SCALE if code == "artefact.good" else Grade.REPEAT
    assert found.assessment.grade is passes


def test_a_certificate_that_is_less_certain_than_the_limit_proves_nothing(
    instrument: Instrument, touching: Touching, ring: Callable[..., FloatArray]
) -> None:
    vague = Artefact(ArtefactKind.RING, 31.751, 0.05)
    found = measured(vague, Conditions(instrument), touching(ring()))

    assert found.assessment.reason.code == "artefact.uncertain"
    assert found.assessment.grade is Grade.CHECK


def test_noise_of_the_form_does_not_put_a_proven_size_in_doubt(
    instrument: Instrument, touching: Touching, ring: Callable[..., FloatArray]
) -> None:
    points = touching(ring())  # of single images
    first = measured(RING, Conditions(instrument), points).part.results
    (form,) = (e.value for e in first if e.planned.certified == 0.0)
    assert form.value < form.uncertainty
    narrow = VerificationLimits(form=form.value / 2)

    found = measured(RING, Conditions(instrument, narrow), points)

    assert found.assessment.grade is Grade.SCALE


def test_no_artefact_says_that_a_wrong_tip_passes(
    instrument: Instrument, touching: Touching, ring: Callable[..., FloatArray]
) -> None:
    wrong = PAPER_TIP + np.array([0.05, 0.0, 0.0])
    of_ring = touching(ring(), tip_pen=wrong, tilt=0.0)
    of_bar = touching(np.array([START, END]), tip_pen=wrong, tilt=0.0)

    for artefact, points in ((RING, of_ring), (BAR, of_bar)):
        found = measured(artefact, Conditions(instrument), points)
        assert found.assessment.grade is not Grade.PASS
        assert "use the tip" not in str(found.assessment.next_step)


@pytest.mark.parametrize(("side", "sign"), [(Side.INSIDE, 1), (Side.OUTSIDE, -1)])
def test_at_faces_the_ball_is_compensated_along_the_length(
    instrument: Instrument, touching: Touching, side: Side, sign: int
) -> None:
    """Between inner faces the ball is short of the ends, on outer ones beyond."""
    points = touching(np.array([START, START, END, END]))
    plain = measured(BAR, Conditions(instrument), points)
    faces = Artefact(ArtefactKind.LENGTH, 150.0 + 4.0 * sign, 0.001, side)
    found = measured(faces, Conditions(instrument, ball_diameter=4.0), points)

    (one,), (other,) = sizes_of(plain.part), sizes_of(found.part)
    assert other.deviation == pytest.approx(one.deviation, abs=1e-9)


def test_a_camera_that_moved_makes_a_length_less_certain_along_it(
    instrument: Instrument, touching: Touching
) -> None:
    points = touching(np.array([START, END]))
    still, across, along = (
        sizes_of(measured(BAR, Conditions(instrument, drift=np.array(by)), points).part)
        for by in ([0.0, 0.0, 0.0], [0.0, 0.01, 0.0], [0.01, 0.0, 0.0])
    )

    u = still[0].value.uncertainty
    assert across[0].value.uncertainty == pytest.approx(u, rel=1e-3)
    # Both ends may be off.
    moved = np.hypot(u, 2 * 0.01 * np.sqrt(2))
    assert along[0].value.uncertainty == pytest.approx(moved, rel=1e-3)


def test_the_limit_of_a_length_is_a_constant_and_what_each_metre_adds(
    instrument: Instrument, touching: Touching
) -> None:
    limits = VerificationLimits(length=0.02, length_per_m=0.1)
    points = touching(np.array([START, END]))
    (found,) = sizes_of(measured(BAR, Conditions(instrument, limits), points).part)

    assert found.margin == pytest.approx(0.02 + 0.1 * 0.15)


def along(*offs: float | tuple[float, float]) -> FloatArray:
    """Points along a line, each also off it."""
    both = [each if isinstance(each, tuple) else (each, 0.0) for each in offs]
    return np.array([PAPER_CONE + np.array([x, y, 0.0]) for x, y in both])


@pytest.mark.parametrize(
    ("places", "code"),
    [
        (along(0.0), "length.too-few"),
        (along(0.0, 9.9), "length.one-end"),
        (along(0.0, 10.1), None),
        (along((0.0, 9.9), (0.0, -9.9), 100.0), None),
        (along((0.0, 10.1), (0.0, -10.1), 100.0), "length.no-end"),
        (along(0.0, (100.0, 9.9), (100.0, -9.9)), None),
        (along(0.0, (100.0, 10.1), (100.0, -10.1)), "length.no-end"),
    ],
)
def test_a_length_has_two_ends(places: FloatArray, code: str | None) -> None:
    if code is None:
        second = are_of_second_end("run", places, 100.0)
        assert 0 < second.sum() < len(places)
        assert len({*places[second, 0]} & {*places[~second, 0]}) == 0
        return
    with pytest.raises(CalibrationError) as error:
        are_of_second_end("run", places, 100.0)
    assert error.value.message.code == code
    if code == "length.no-end":
        assert error.value.message.values["distance"] == pytest.approx(10.1)
