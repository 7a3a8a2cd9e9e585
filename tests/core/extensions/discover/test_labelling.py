"""Swings during which LEDs are covered, reflected, or the tip slips."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers
from tests.simulated_stations import Station, errors_of, random_station, seen_station

from lightpen.arrays import FloatArray, IntArray
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.rigid import rig_of, rotation_from_vector
from lightpen_extensions.discover.discover import discover
from lightpen_extensions.discover.found import Discovery
from lightpen_extensions.discover.hypotheses import Seed
from lightpen_extensions.discover.labelling import (
    MOST_IN_VAIN,
    Labelled,
    _Search,
    label,
)
from lightpen_extensions.discover.starts import Start, ideal_camera
from lightpen_extensions.discover.tracks import Pieces
from lightpen_extensions.simulator.swings import Postures, Swing, swing_from_postures

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


N_SOLVED, CONE = 18, np.array([0.0, 200.0, 5000.0])
CAMERA = ideal_camera(2448, 2048, 10000.0)
FLAT = replace(
    STATION.pen,
    leds=STATION.pen.leds * [1, 1, 0]
    - (STATION.pen.leds.mean(axis=0) * [1, 1, 0] - [0, 200, 0]),
)


def turning(n: int) -> tuple[Swing, FloatArray]:
    """Return a swing past the view from the front, and its images (n, L, 2), px."""
    postures = Postures(np.linspace(-0.6, 0.6, n), np.full(n, np.pi / 2), np.zeros(n))
    swing = swing_from_postures(postures, np.zeros(3), CONE)
    rng = np.random.default_rng(5)
    R, t = swing.rotations, swing.translations
    return swing, simulate_centers(CAMERA, FLAT, R, t, 0.03, rng)


def labelled(swing: Swing, pixels: FloatArray, spots: IntArray) -> Labelled:
    """Return the labels by the first images, of which the turns are known."""
    pieces = Pieces(pixels, spots)
    R = swing.rotations[:N_SOLVED]
    start = Start(BundleState(rig_of(CAMERA), FLAT, np.zeros(3), CONE, R), 0.03)
    seed = Seed(np.arange(N_SOLVED), np.arange(FLAT.n_leds), start, (), np.inf)
    return label(seed, pieces, tuple(pixels), CAMERA.width)


def test_a_flat_pen_that_passes_the_view_from_the_front_does_not_turn_back() -> None:
    swing, pixels = turning(40)

    found = labelled(swing, pixels, np.tile(np.arange(FLAT.n_leds), (40, 1)))

    assert len(found.images) == 40
    np.testing.assert_allclose(
        found.state.rotations, swing.rotations, atol=np.radians(2)
    )


def test_a_pen_that_is_gone_is_sought_in_some_images_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    swing, pixels = turning(120)
    gone = pixels[N_SOLVED:]
    gone[:] = np.random.default_rng(6).uniform(0, 2000, gone.shape)
    spots = np.full(pixels.shape[:2], -1)
    spots[:N_SOLVED] = np.arange(FLAT.n_leds)
    sought = set()
    monkeypatch.setattr(_Search, "_settles", lambda self, i, spots: sought.add(i))

    found = labelled(swing, pixels, spots)

    assert found.images.tolist() == list(range(N_SOLVED))
    assert len(sought) == MOST_IN_VAIN
    assert np.ptp(list(sought)) > 80


def test_an_led_is_found_though_some_turns_are_wrong() -> None:
    swing, pixels = turning(40)
    state = BundleState(rig_of(CAMERA), FLAT, np.zeros(3), CONE, swing.rotations)
    none = Pieces(pixels, np.full(pixels.shape[:2], -1))
    search = _Search(state, none, tuple(pixels), CAMERA.width)
    wrong = rotation_from_vector(np.array([[0.0, 0.2, 0.0]]))
    search.rotations[:] = swing.rotations
    search.rotations[:4] = wrong @ swing.rotations[:4]
    every = np.arange(40)

    point = search._fixed_to_pen(every, pixels[:, 3])

    assert point is not None
    np.testing.assert_allclose(point, FLAT.leds[3], atol=0.5)
    apart = pixels[:, 3] + np.linspace(0, 40, 40)[:, None] * [1, -1]
    assert search._fixed_to_pen(every, apart) is None
