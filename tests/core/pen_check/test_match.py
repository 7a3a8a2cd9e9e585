"""The live match on exact disc images plus noise, of a pen that an operator swings."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.detection.spots import SpotFlaw, Spots
from lightpen.messages import message
from lightpen.model.ellipse import disc_images
from lightpen.model.pen import Pen
from lightpen.pen_check.match import MAX_VIEWS, Finding, PenMatch, add_view, match_pen
from lightpen_extensions.simulator.camera import SkippingClock
from lightpen_extensions.simulator.hand import SimulatedOperator
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    leds_in_camera,
    paper_camera,
    paper_pen,
)

CAMERA = paper_camera()
PEN = paper_pen()
NOISE = 0.05  # px
TWO_SECONDS = 40  # images


def unseen(led: int) -> Finding:
    return Finding(message("match.unseen", led=led), (led,))


def seen(
    pen: Pen, R: FloatArray, t: FloatArray, rng: np.random.Generator, hidden: int = -1
) -> Spots:
    """Return the spots of one image, in any order; an LED (from 0) may be hidden."""
    leds, normals = leds_in_camera(pen, R, t)
    discs = disc_images(CAMERA, leds, normals, pen.diameter / 2)
    order = rng.permutation(np.delete(np.arange(pen.n_leds), max(hidden, 0)))
    if hidden < 0:
        order = rng.permutation(pen.n_leds)
    n = len(order)
    shapes = discs.shapes[order]
    return Spots(
        centers=discs.centers[order] + rng.normal(0, NOISE, (n, 2)),
        shapes=shapes,
        areas=4 * np.pi * np.sqrt(np.linalg.det(shapes)),
        contrasts=np.full(n, 0.6),
        edge_widths=np.full(n, 2.0),
        flaws=np.zeros(n, dtype=np.int64),
        sigmas=np.full(n, 0.01),
        offsets=np.zeros((n, 2)),
    )


def images(
    seed: int = 1, *, pen: Pen = PEN, swings: bool = True, hidden: int = -1
) -> Iterator[Spots]:
    """Yield what 20 images a second show of a pen that is swung, or held still."""
    rng = np.random.default_rng(seed)
    clock = SkippingClock()
    operator = SimulatedOperator(clock, seed, seated=True)
    if swings:
        operator.swing()
    clock.wait(1.0)
    while True:
        clock.wait(0.05)
        held = operator.held(np.array([clock.now_ns() * 1e-9]))
        R = held.postures.rotations[0]
        t = PAPER_CONE + held.offsets[0] - R @ PAPER_TIP
        yield seen(pen, R, t, rng, hidden)


def views_of(images: Iterator[Spots], n_images: int = TWO_SECONDS) -> tuple[Spots, ...]:
    views: tuple[Spots, ...] = ()
    for spots in islice(images, n_images):
        views = add_view(views, spots)
    return views


SWUNG = views_of(images())


def with_leds(leds: FloatArray) -> Pen:
    normals = np.tile([0.0, 0.0, 1.0], (len(leds), 1))
    return replace(PEN, leds=leds, normals=normals)


def moved(led: int, by: tuple[float, float, float]) -> Pen:
    """Return the pen with the LED of a number moved in its file."""
    leds = PEN.leds.copy()
    leds[led - 1] += by
    return with_leds(leds)


def the_finding(match: PenMatch) -> Finding:
    (finding,) = match.findings
    return finding


def test_a_true_file_fits() -> None:
    match = match_pen(CAMERA, PEN, SWUNG)

    assert match.fits
    assert match.n_labelled == match.n_views == len(SWUNG)
    np.testing.assert_allclose(match.rms, NOISE * np.sqrt(2), rtol=0.5)


@pytest.mark.slow
def test_twenty_clean_swings_raise_no_alarm() -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        pen = replace(PEN, leds=PEN.leds + rng.normal(0, 0.005, PEN.leds.shape))
        views = views_of(images(seed, swings=seed % 2 == 0))
        assert match_pen(CAMERA, pen, views).findings == ()


@pytest.mark.slow
def test_an_led_half_a_millimetre_off_is_named_within_two_seconds() -> None:
    named = []
    for seed in range(20):
        rng = np.random.default_rng([seed, 1])
        by = rng.normal(size=2)
        by *= 0.5 / np.linalg.norm(by)
        led = int(rng.integers(1, 11))
        match = match_pen(CAMERA, moved(led, (*by, 0.0)), views_of(images(seed)))
        named.append([finding.leds for finding in match.findings] == [(led,)])
    assert np.mean(named) >= 0.95


def test_an_led_far_off_is_not_detected_at_its_place() -> None:
    finding = the_finding(match_pen(CAMERA, moved(9, (0.0, 40.0, 5.0)), SWUNG))

    assert finding == unseen(9)


def test_a_pen_fits_when_it_was_seen_in_views_enough() -> None:
    assert not match_pen(CAMERA, PEN, SWUNG[:4]).fits
    assert match_pen(CAMERA, PEN, SWUNG[:5]).fits


def test_leds_exchanged_as_a_whole_fit_the_images() -> None:
    # LEDs are alike: only the frame can tell, see `frame_check`.
    leds = PEN.leds.copy()
    leds[[4, 7]] = leds[[7, 4]]

    assert match_pen(CAMERA, with_leds(leds), SWUNG).fits


def test_an_led_that_is_off_is_named() -> None:
    views = views_of(images(hidden=5))

    assert match_pen(CAMERA, PEN, views).findings == (unseen(6),)


def test_a_mirrored_file_is_reported_as_such() -> None:
    mirrored = with_leds(PEN.leds * np.array([-1.0, 1.0, 1.0]))

    finding = the_finding(match_pen(CAMERA, mirrored, SWUNG))

    assert "mirror image" in str(finding.message)


def test_another_pen_is_reported_as_such() -> None:
    other = with_leds(np.random.default_rng(3).uniform(-60, 60, (10, 3)))

    match = match_pen(CAMERA, other, SWUNG)

    assert (match.n_labelled, match.fits) == (0, False)
    assert "do not match the" in str(the_finding(match).message)


def test_leds_that_are_all_a_little_off_are_a_misfit_of_none() -> None:
    rng = np.random.default_rng(4)
    pen = replace(PEN, leds=PEN.leds + rng.normal(0, 0.1, PEN.leds.shape))

    finding = the_finding(match_pen(CAMERA, pen, SWUNG))

    assert (finding.message.code, finding.leds) == ("match.misfit", ())


def test_without_views_nothing_is_reported() -> None:
    match = match_pen(CAMERA, PEN, ())

    assert (match.n_views, match.findings, match.fits) == (0, (), False)


def test_views_that_are_alike_count_once() -> None:
    views = views_of(images(swings=False))

    assert len(views) < 4


def test_the_newest_of_views_that_are_alike_is_kept() -> None:
    first = SWUNG[0]
    newer = replace(first, contrasts=first.contrasts + 0.1)

    assert add_view((first,), newer) == (newer,)


def test_old_views_make_room() -> None:
    views = views_of(images(), 200)

    assert len(views) == MAX_VIEWS


def test_smeared_and_nearly_empty_images_are_passed_over() -> None:
    spots = SWUNG[0]
    smeared = replace(spots, flaws=np.full(len(spots), int(SpotFlaw.BLURRED)))
    empty = Spots(
        *(spots.centers[:2], spots.shapes[:2], spots.areas[:2]),
        *(spots.contrasts[:2], spots.edge_widths[:2], spots.flaws[:2]),
        *(spots.sigmas[:2], spots.offsets[:2]),
    )

    assert add_view((), smeared) == ()
    assert add_view((), empty) == ()
