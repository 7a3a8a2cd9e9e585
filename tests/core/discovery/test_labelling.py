"""Images of which the LEDs are known by the shape of the pen alone."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_stations import Station, errors_of, random_station

from lightpen.discovery.discover import discover
from lightpen.discovery.found import Discovery

STATION = random_station(31000)


def require_true(found: Discovery, station: Station) -> None:
    off = errors_of(found, station).tip / found.expanded_uncertainty
    assert np.abs(off).max() < 1.5


@pytest.mark.slow
def test_images_after_all_leds_were_covered_take_part() -> None:
    pixels = STATION.pixels.copy()
    for start in (40, 120, 210):
        pixels[start : start + 12] = np.nan
    station = replace(STATION, pixels=pixels)

    found = discover(station.sightings, station.request)

    assert found.calibration.used.sum() > 0.9 * 264
    require_true(found, station)


@pytest.mark.slow
def test_a_reflection_in_place_of_an_led_for_a_while_is_no_led() -> None:
    pixels = STATION.pixels.copy()
    pixels[180:240, 2] += np.array([12.0, 8.0]) + 0.05 * np.arange(60)[:, None]
    station = replace(STATION, pixels=pixels)

    found = discover(station.sightings, station.request)

    assert found.pen.n_leds == STATION.pen.n_leds
    require_true(found, station)
