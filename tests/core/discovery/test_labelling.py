"""Swings during which LEDs are covered, reflected, or the tip slips."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_stations import Station, errors_of, random_station, seen_station

from lightpen.discovery.discover import discover
from lightpen.discovery.found import Discovery
from lightpen.discovery.hypotheses import Seed
from lightpen.discovery.labelling import label
from lightpen.discovery.starts import Start, ideal_camera
from lightpen.discovery.tracks import Pieces
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.rig import rig_of
from lightpen.simulator.postures import Postures
from lightpen.simulator.swings import simulate_centers, swing_from_postures

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


@pytest.mark.slow
def test_a_small_slip_shifts_neither_lens_nor_normal() -> None:
    rng = np.random.default_rng(34007)
    before = random_station(34007)
    slip = rng.standard_normal(3)
    translations = before.swing.translations.copy()
    translations[140:160] += 0.1 * slip / np.linalg.norm(slip)  # mm
    swing = replace(before.swing, translations=translations)
    station = seen_station(before.camera, before.pen, swing, 0.03, 0.02, rng)

    require_true(discover(station.sightings, station.request), station)


def test_a_flat_pen_that_passes_the_view_from_the_front_does_not_turn_back() -> None:
    n, n_solved, cone = 40, 18, np.array([0.0, 200.0, 5000.0])
    camera = ideal_camera(2448, 2048, 10000.0)
    tip = STATION.pen.leds.mean(axis=0) * [1, 1, 0] - [0, 200, 0]
    pen = replace(STATION.pen, leds=STATION.pen.leds * [1, 1, 0] - tip)
    postures = Postures(np.linspace(-0.6, 0.6, n), np.full(n, np.pi / 2), np.zeros(n))
    swing = swing_from_postures(postures, np.zeros(3), cone)
    R = swing.rotations
    rng = np.random.default_rng(5)
    pixels = simulate_centers(camera, pen, R, swing.translations, 0.03, rng)
    pieces = Pieces(pixels, np.tile(np.arange(pen.n_leds), (n, 1)))
    state = BundleState(rig_of(camera), pen, np.zeros(3), cone, R[:n_solved])
    start = Start(state, 0.03)
    seed = Seed(np.arange(n_solved), np.arange(pen.n_leds), start, (), np.inf)

    found = label(seed, pieces, pieces, tuple(pixels), camera.width)

    assert len(found.images) == n
    np.testing.assert_allclose(found.state.rotations, R, atol=np.radians(2))
