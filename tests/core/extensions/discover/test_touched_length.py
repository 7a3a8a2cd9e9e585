from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated_stations import errors_of, leaning, random_station, seen_station

from lightpen.detection.observations import observe_centers
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.observation_files import Centers
from lightpen_extensions.discover.discover import discover, with_touched_length
from lightpen_extensions.discover.found import Discovery
from lightpen_extensions.discover.hypotheses import number_by_sketch
from lightpen_extensions.discover.scale import TouchedLength
from lightpen_extensions.measure.probing.probing import ONE_IMAGE
from lightpen_extensions.measure.probing.sources import touches_of
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint
from lightpen_extensions.simulator.swings import swing_from_postures

N = 60  # images
STATION = random_station(6, n_images=N)
FREE = replace(STATION.request, lengths=())
N_TOUCHES = 10  # images of each end
APART = 0.5 * STATION.longest * np.array([0.9, 0.1, 0.3])  # mm, from end to end
SIGMA = 0.002  # mm


def touches(instrument: Instrument) -> tuple[ProbedPoint, ...]:
    """Return the touches of both ends, each image one."""
    swing, rng = STATION.swing, np.random.default_rng(3)
    every = np.arange(0, N, N // N_TOUCHES)
    held = leaning(swing.postures, 0.3)
    pixels = []
    for end in (-0.5, 0.5):
        other = swing_from_postures(held, swing.tip_pen, swing.cone_cam + end * APART)
        seen = seen_station(STATION.camera, STATION.pen, other, 0.03, 0.0, rng)
        pixels.append(seen.pixels[every])
    order = np.argsort(number_by_sketch(instrument.pen.leds, STATION.pen.leds))
    found = np.concatenate(pixels)[:, order]
    centers = Centers(np.arange(len(found)), found, Path("ends.csv"))
    view = observe_centers(centers, instrument.camera, instrument.pen)
    return touches_of("ends.csv", (view,), instrument, ONE_IMAGE).touches


def touched(factor: float = 1.0) -> TouchedLength:
    distance = factor * float(np.linalg.norm(APART))
    return TouchedLength(touches, distance, SIGMA)


@pytest.fixture(scope="module")
def relative() -> Discovery:
    return discover(STATION.sightings, FREE)


def test_touches_of_both_ends_give_the_distance_of_two_leds(
    relative: Discovery,
) -> None:
    request = with_touched_length(replace(FREE, touched=touched()), relative)

    (known,) = request.lengths
    assert abs(known.length - STATION.longest) < 3 * known.sigma
    assert known.sigma > SIGMA * known.length / np.linalg.norm(APART)
    assert known.sigma < 1e-3 * known.length


def test_a_touched_length_that_contradicts_the_known_length_is_refused(
    relative: Discovery,
) -> None:
    right = replace(STATION.request, touched=touched())
    assert len(with_touched_length(right, relative).lengths) == 2
    with pytest.raises(CalibrationError, match="ends contradicts the length"):
        with_touched_length(replace(right, touched=touched(1.01)), relative)


@pytest.mark.slow
def test_a_certified_length_touched_afterwards_gives_tip_and_leds_to_scale() -> None:
    found = discover(STATION.sightings, replace(FREE, touched=touched()))

    assert not found.is_relative
    errors = errors_of(found, STATION)
    assert (np.abs(errors.tip) < 1.75 * found.expanded_uncertainty).all()
    assert errors.led_rms < 0.03


@pytest.mark.slow
def test_a_touched_length_that_contradicts_the_discs_is_refused() -> None:
    # Without images the centres alone tell the size of the discs, by their shift.
    with pytest.raises(CalibrationError, match="Check which length was touched"):
        discover(STATION.sightings, replace(FREE, touched=touched(0.15)))
