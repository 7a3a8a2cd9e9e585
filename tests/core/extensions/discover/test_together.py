from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_stations import Station, errors_of, random_station, seen_station

from lightpen.errors import CalibrationError
from lightpen_extensions.discover.report import picture_of_pen
from lightpen_extensions.discover.together import (
    Together,
    common_part,
    discover_together,
    joined,
)
from lightpen_extensions.simulator.swings import (
    FRAME_RATE,
    operator_postures,
    swing_from_postures,
)

N = 60  # images
FIRST = random_station(6, n_images=N)


def again(seed: int) -> Station:
    """Return another swing of the same pen in the same cone."""
    swing = FIRST.swing
    postures = operator_postures(np.arange(N) / FRAME_RATE, seed)
    other = swing_from_postures(postures, swing.tip_pen, swing.cone_cam)
    rng = np.random.default_rng(seed)
    return seen_station(FIRST.camera, FIRST.pen, other, 0.03, 0.02, rng)


@pytest.fixture(scope="module")
def together() -> Together:
    return discover_together((FIRST.sightings, again(1).sightings), FIRST.request)


@pytest.mark.slow
def test_two_swings_know_more_than_each_and_are_true(together: Together) -> None:
    found = together.found
    for each in together.swings:
        ratio = found.expanded_uncertainty / each.expanded_uncertainty
        assert (ratio < 1.0).all()  # though the second swing is weak in y
        assert (found.intrinsics_sigma < each.intrinsics_sigma).all()
    errors = errors_of(found, FIRST)
    assert (np.abs(errors.tip) < 1.75 * found.expanded_uncertainty).all()
    assert (np.abs(errors.intrinsics) < 3.5 * found.intrinsics_sigma).all()


def test_the_length_is_common_to_all_swings(together: Together) -> None:
    (known,) = together.found.lengths
    leds = together.found.pen.leds
    length = float(np.linalg.norm(leds[known.first] - leds[known.second]))
    assert length == pytest.approx(known.length, abs=2e-4)


def test_what_no_image_shows_is_no_better_known_by_two_swings(
    together: Together,
) -> None:
    each = together.swings[0]
    twice = joined((each, each))
    # Centres alone hardly show the size of the discs; the focal length they do.
    assert twice.pen.diameter_sigma == pytest.approx(each.pen.diameter_sigma, rel=0.02)
    ratio = twice.intrinsics_sigma[0] / each.intrinsics_sigma[0]
    assert ratio == pytest.approx(0.5**0.5, rel=0.02)


def test_what_covariances_have_in_common_is_less_than_each() -> None:
    rng = np.random.default_rng(1)
    one, other = (root @ root.T for root in rng.standard_normal((2, 3, 3)))
    common = common_part(one, other)
    for more in (one - common, other - common, common):
        assert np.linalg.eigvalsh(more).min() > -1e-9
    np.testing.assert_allclose(common_part(one, 3 * one), one, atol=1e-9)
    np.testing.assert_allclose(common_part(one, 0 * one), 0, atol=1e-9)


def test_the_swing_held_out_agrees_with_the_others(together: Together) -> None:
    assert together.held_out.worst < 3.5
    assert np.abs(together.held_out.tip).max() < 0.1


def test_swings_with_images_of_two_sizes_are_refused() -> None:
    smaller = replace(FIRST.sightings, size=(2448, 2040))
    with pytest.raises(CalibrationError, match="another size"):
        discover_together((FIRST.sightings, smaller), FIRST.request)


@pytest.mark.slow
def test_a_swing_of_another_pen_is_refused_by_its_number() -> None:
    other = random_station(7, n_images=N).sightings
    with pytest.raises(CalibrationError, match="Swing 2 does not show the LEDs"):
        discover_together((FIRST.sightings, other), FIRST.request)


def test_the_picture_shows_the_pen_upright(together: Together) -> None:
    assert picture_of_pen(together.found).startswith(b"\x89PNG")
