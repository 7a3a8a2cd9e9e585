from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from tests.simulated_stations import (
    Station,
    errors_of,
    leaning,
    random_station,
    seen_station,
)

from lightpen.errors import CalibrationError
from lightpen.formats.observation_files import read_unlabelled_centers
from lightpen_extensions.discover import hypotheses
from lightpen_extensions.discover.discover import discover
from lightpen_extensions.discover.found import Discovery
from lightpen_extensions.discover.report import discovery_text
from lightpen_extensions.discover.scale import MeasuredLength, Request
from lightpen_extensions.discover.tracks import Sightings, sightings_of_centers
from lightpen_extensions.simulator.swings import swing_from_postures

DATA = Path(__file__).parents[3] / "data"
N = 160  # images: 8 s, a little more than once round the cone
STATION = random_station(6, n_images=N)
SHORT = random_station(6, n_images=60)


@pytest.fixture(scope="module")
def found() -> Discovery:
    return SHORT.discovered()


def with_centers(
    station: Station, change: Callable[[list[np.ndarray]], list[np.ndarray]]
) -> Sightings:
    """Return the sightings of a station with its list of centres changed."""
    seen = station.sightings
    centers = tuple(change(list(seen.centers)))
    return replace(seen, centers=centers, names=seen.names[: len(centers)])


def refused(sightings: Sightings, station: Station = STATION) -> str:
    with pytest.raises(CalibrationError) as caught:
        discover(sightings, station.request)
    return caught.value.message.code


@pytest.mark.slow
def test_tip_pen_and_camera_are_found_within_their_uncertainties() -> None:
    found = STATION.discovered()
    errors = errors_of(found, STATION)

    # 2 standard deviations of each of 3, 9 and 30 numbers; 3.5 are met by all.
    assert (np.abs(errors.tip) < 1.75 * found.expanded_uncertainty).all()
    assert np.abs(errors.tip).max() < 0.04
    assert (np.abs(errors.intrinsics) < 3.5 * found.intrinsics_sigma).all()
    assert abs(errors.intrinsics[0]) < 3e-4 * STATION.camera.fx
    assert (np.abs(errors.leds) < 2 * found.led_uncertainty[errors.order]).all()
    assert errors.led_rms < 0.003


def test_every_image_and_every_led_takes_part(found: Discovery) -> None:
    assert found.calibration.used.all()
    assert found.pen.n_leds == SHORT.pen.n_leds
    n_seen = int(np.isfinite(SHORT.pixels[..., 0]).sum())
    assert found.calibration.cameras[0].leds_used.sum() > 0.99 * n_seen


def test_the_mirror_image_fits_far_worse(found: Discovery) -> None:
    (best,) = (each for each in found.hypotheses if each.is_best)
    (other,) = (each for each in found.hypotheses if not each.is_best)
    assert best.mirrored != other.mirrored
    assert other.misfit > 20 * best.misfit


def test_leds_are_numbered_from_the_tip_upwards(found: Discovery) -> None:
    heights = found.pen.leds[:, 1]
    size = np.ptp(heights)
    assert (np.diff(heights) > -0.05 * size).all()
    assert heights[0] > found.tip_pen[1]
    np.testing.assert_allclose(found.pen.leds[0], 0, atol=1e-9)
    np.testing.assert_allclose(found.pen.leds[-1, [0, 2]], 0, atol=1e-9)


@pytest.mark.slow
def test_a_known_camera_makes_the_tip_more_certain(found: Discovery) -> None:
    sigmas = np.array([1.0, 1.0, 0.5, 0.5, 1e-3, 1e-3, 1e-5, 1e-5, 1e-3])
    camera = replace(STATION.camera, covariance=np.diag(sigmas**2))

    known = discover(SHORT.sightings, replace(SHORT.request, camera=camera))

    # The weak axis gains; the noise is estimated anew, to a part in a hundred.
    assert known.expanded_uncertainty[1] < 0.9 * found.expanded_uncertainty[1]
    assert (known.expanded_uncertainty < 1.02 * found.expanded_uncertainty).all()
    errors = errors_of(known, SHORT)
    assert (np.abs(errors.tip) < 1.75 * known.expanded_uncertainty).all()


@pytest.mark.slow
def test_an_uncertain_length_makes_the_tip_uncertain_in_proportion() -> None:
    length = MeasuredLength(None, STATION.longest, 0.02)
    found = discover(STATION.sightings, replace(STATION.request, lengths=(length,)))

    lever = np.abs(found.tip_pen - found.pen.leds.mean(axis=0))
    by_length = 2 * 0.02 / STATION.longest * lever
    assert (found.expanded_uncertainty > 0.99 * by_length).all()
    assert found.expanded_uncertainty[1] < 1.5 * by_length[1]


@pytest.mark.slow
def test_without_a_length_the_result_is_relative() -> None:
    found = discover(STATION.sightings, replace(STATION.request, lengths=()))

    assert found.is_relative
    assert "µm" not in discovery_text(found)
    leds = found.pen.leds
    longest = np.linalg.norm(leds[:, None] - leds, axis=2).max()
    assert longest == pytest.approx(100, rel=1e-4)
    factor = STATION.longest / 100
    errors = errors_of(
        replace(
            found,
            pen=replace(found.pen, leds=factor * leds),
            tip_pen=factor * found.tip_pen,
        ),
        STATION,
    )
    assert np.abs(errors.tip).max() < 0.15


@pytest.mark.slow
def test_small_discs_of_unknown_size_do_not_keep_the_adjustment_from_converging() -> (
    None
):
    pen = replace(STATION.pen, diameter=0.02 * STATION.longest)
    rng = np.random.default_rng(2)
    station = seen_station(STATION.camera, pen, STATION.swing, 0.03, 0.02, rng)

    found = discover(station.sightings, replace(STATION.request, lengths=()))

    assert 0 < found.pen.diameter < 5  # hundredths of the longest distance


@pytest.mark.slow
def test_a_tip_that_slips_and_lights_that_are_none_are_left_out() -> None:
    rng = np.random.default_rng(7)
    swing = STATION.swing
    tips = swing.tips_cam.copy()
    tips[60:75] += [0.8, 0.0, 0.5]
    slipping = swing_from_postures(swing.postures, swing.tip_pen, swing.cone_cam, tips)
    station = seen_station(STATION.camera, STATION.pen, slipping, 0.03, 0.05, rng)
    lamp = np.array([[300.0, 250.0]])

    def spoiled(centers: list[np.ndarray]) -> list[np.ndarray]:
        stray = [rng.uniform(0, 2000, (rng.integers(0, 3), 2)) for _ in centers]
        return [
            np.concatenate([c, s, lamp + 0.03 * rng.standard_normal((1, 2))])
            for c, s in zip(centers, stray, strict=True)
        ]

    found = discover(with_centers(station, spoiled), station.request)

    errors = errors_of(found, station)
    assert found.n_lamps == 1
    assert not found.calibration.used[60:75].any()
    assert (np.abs(errors.tip) < 2 * found.expanded_uncertainty).all()
    assert found.expanded_uncertainty.max() < 0.1


@pytest.mark.slow
def test_images_out_of_order_are_refused() -> None:
    def shuffled(centers: list[np.ndarray]) -> list[np.ndarray]:
        order = np.random.default_rng(2).permutation(len(centers))
        return [centers[i] for i in order]

    code = refused(with_centers(STATION, shuffled))
    assert code == "discover.not-followed"


def test_few_images_are_refused() -> None:
    code = refused(with_centers(STATION, lambda centers: centers[:39]))
    assert code == "discover.too-few-images"


def test_a_pen_of_four_leds_is_refused() -> None:
    few = replace(STATION, pixels=STATION.pixels.copy())
    few.pixels[:, 4:] = np.nan
    assert refused(few.sightings, few) == "discover.too-few-leds"


@pytest.mark.slow
def test_a_second_pen_is_refused() -> None:
    other = random_station(8, n_images=N)

    def both(centers: list[np.ndarray]) -> list[np.ndarray]:
        more = other.sightings.centers
        return [np.concatenate(pair) for pair in zip(centers, more, strict=True)]

    assert refused(with_centers(STATION, both)) == "discover.two-pens"


@pytest.mark.slow
@pytest.mark.parametrize("zoom", [1.03, 1.003])
def test_a_camera_that_zooms_midway_is_refused(zoom: float) -> None:
    camera = STATION.camera
    longer = replace(camera, fx=zoom * camera.fx, fy=zoom * camera.fy)
    rng = np.random.default_rng(4)
    after = seen_station(longer, STATION.pen, STATION.swing, 0.03, 0.02, rng)
    pixels = np.concatenate([STATION.pixels[:80], after.pixels[80:]])
    zoomed = replace(STATION, pixels=pixels)
    assert refused(zoomed.sightings, zoomed) in {
        "discover.camera-changed",
        "discover.many-left-out",  # whose words name zoom and focus, too
    }


@pytest.mark.slow
def test_a_swing_that_hardly_tilts_is_refused() -> None:
    swing = STATION.swing
    rng = np.random.default_rng(5)
    upright = swing_from_postures(
        leaning(swing.postures, 0.03), swing.tip_pen, swing.cone_cam
    )
    station = seen_station(STATION.camera, STATION.pen, upright, 0.03, 0.02, rng)
    assert refused(station.sightings, station) in {
        "discover.mirror-undecided",
        "discover.no-start",
        "discover.weak-swing",
        "coverage.hardly-moved",
    }


@pytest.mark.slow
def test_two_lengths_that_contradict_each_other_are_refused(found: Discovery) -> None:
    leds = found.pen.leds
    right = float(np.linalg.norm(leds[0] - leds[-1]))
    wrong = float(np.linalg.norm(leds[1] - leds[-1])) + 2.0
    n = found.pen.n_leds
    lengths = (MeasuredLength((1, n), right, 0.01), MeasuredLength((2, n), wrong, 0.01))
    with pytest.raises(CalibrationError) as caught:
        discover(STATION.sightings, replace(STATION.request, lengths=lengths))
    assert caught.value.message.code == "discover.lengths-contradict"


@pytest.mark.slow
def test_a_length_to_an_led_that_is_none_is_refused() -> None:
    lengths = (MeasuredLength((1, 40), 100.0, 0.01),)
    with pytest.raises(CalibrationError, match="no LED 40"):
        discover(STATION.sightings, replace(STATION.request, lengths=lengths))


def with_loose_leds(station: Station, amplitude: float) -> Station:
    """Return a station whose LEDs move on the pen, each by itself, px."""
    pixels = station.pixels
    phases = np.random.default_rng(1).uniform(0, 2 * np.pi, pixels.shape[1:])
    moves = np.sin(np.arange(len(pixels))[:, None, None] / 15 + phases)
    return replace(station, pixels=pixels + amplitude * moves)


@pytest.mark.slow
def test_leds_that_move_on_the_pen_are_refused() -> None:
    loose = with_loose_leds(SHORT, 1.0)
    assert refused(loose.sightings, loose) == "discover.not-settled"


@pytest.mark.slow
def test_leds_that_move_far_are_refused_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    attempts = Mock(wraps=hypotheses._attempted)
    monkeypatch.setattr(hypotheses, "_attempted", attempts)
    loose = with_loose_leds(STATION, 20.0)

    assert refused(loose.sightings, loose) == "discover.no-fit"
    assert attempts.call_count <= 30  # half a second each


@pytest.mark.slow
def test_halves_that_do_not_fit_together_are_refused() -> None:
    station = random_station(901, n_images=N)
    middle = np.array([station.camera.width, station.camera.height]) / 2

    def zoomed(centers: list[np.ndarray]) -> list[np.ndarray]:
        later = [middle + 1.003 * (each - middle) for each in centers[N // 2 :]]
        return [*centers[: N // 2], *later]

    assert refused(with_centers(station, zoomed), station) == "discover.halves-apart"


@pytest.mark.slow
def test_a_flat_pen_is_found_where_the_first_starts_only_nearly_fit() -> None:
    """Simulated by a projection of its own; the true distances of the LEDs in mm."""
    given = read_unlabelled_centers(DATA / "flat-pen-centers.csv")
    seen = sightings_of_centers(
        tuple(map(str, given.frames)), given.centers, (1280, 1024)
    )
    length = MeasuredLength(None, 165.0968, 0.001)

    found = discover(seen, Request((length,), 10.0))

    from_tip = np.sort(np.linalg.norm(found.pen.leds - found.tip_pen, axis=1))
    true = [113.3888, 184.0272, 217.7966, 231.7566, 278.4132]
    U = float(found.expanded_uncertainty.max())
    assert U < 0.3
    np.testing.assert_allclose(from_tip, true, atol=U)
