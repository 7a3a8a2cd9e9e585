"""An instrument of files is as uncertain as they state."""

from dataclasses import replace

import numpy as np
import pytest
from tests.accepted_tip import Hold, Holder
from tests.simulated_rigs import from_first, row_of_cameras

from lightpen.detection.pen_detection import unseen
from lightpen.detection.reasons import Reason
from lightpen.model.rigid import rig_of
from lightpen_extensions.measure.probing.instruments import (
    instrument_of_files,
    see_together,
    with_rig,
)
from lightpen_extensions.simulator.swings import PAPER_TIP, paper_camera, paper_pen

RIG = rig_of(paper_camera())
BOTH = replace(from_first(row_of_cameras(2, 800.0)), names=("left", "right"))
PEN = replace(paper_pen(), led_sigma=0.002)
TIP = np.diag([1e-6, 4e-6, 9e-6])  # mm^2
LOOSE = replace(PEN, scale_sigma=3e-5, diameter_sigma=0.03)


def test_an_instrument_of_files_is_as_uncertain_as_they_state() -> None:
    rig = row_of_cameras(3, 1000.0)
    found = instrument_of_files(rig, LOOSE, PAPER_TIP, TIP, 0.02)

    at, n_leds = found.parameters, LOOSE.n_leds
    sizes = [3, 9, 9, 9, 12, 1, 3 * n_leds]
    kinds = [at.tip, *at.cameras, at.extrinsics, at.diameter, at.leds]
    ends = np.cumsum(sizes).tolist()
    assert kinds == [slice(e - n, e) for e, n in zip(ends, sizes, strict=True)]
    leds = found.covariance[at.leds, at.leds]
    # Shifts and turns of all LEDs are none of their errors; the scale is about the tip.
    by_scale = (LOOSE.leds - PAPER_TIP).ravel()
    alone = leds - 3e-5**2 * np.outer(by_scale, by_scale)
    arms = LOOSE.leds - LOOSE.leds.mean(axis=0)
    for axis in np.eye(3):
        moves = np.tile(axis, n_leds), np.cross(axis, arms).ravel()
        np.testing.assert_allclose(alone @ np.column_stack(moves), 0, atol=1e-15)
    assert np.trace(alone) == pytest.approx((3 * n_leds - 6) * 0.002**2)
    parts = [TIP, *(each.covariance for each in rig.cameras), rig.covariance]
    parts += [np.array([[0.03**2]]), leds]
    for place, part in zip(kinds, parts, strict=True):
        assert part is not None
        np.testing.assert_allclose(found.covariance[place, place], part)
    for place in (*at.cameras, at.extrinsics, at.diameter):
        others = np.delete(found.covariance[place], np.r_[place], axis=1)
        assert not others.any()
    assert (found.sigma, found.tip_pen.tolist()) == (0.02, PAPER_TIP.tolist())


def test_a_stated_covariance_of_the_leds_is_taken_beside_their_scale() -> None:
    stated = np.diag(np.linspace(1e-6, 3e-6, 3 * PEN.n_leds))
    pens = [replace(LOOSE, led_covariance=stated), replace(LOOSE, led_sigma=None)]
    reported, silent = (instrument_of_files(RIG, p, PAPER_TIP, TIP, 0.02) for p in pens)

    leds = reported.parameters.leds
    more = reported.covariance - silent.covariance
    np.testing.assert_allclose(more[leds, leds], stated, atol=1e-18)


def test_an_instrument_before_another_rig_keeps_its_pen_and_tip() -> None:
    old = instrument_of_files(RIG, LOOSE, PAPER_TIP, TIP, 0.02)
    rig = row_of_cameras(2, 1000.0)

    found = with_rig(old, rig)

    at, was = found.parameters, old.parameters
    kept, before = (np.r_[each.tip, each.diameter, each.leds] for each in (at, was))
    np.testing.assert_array_equal(
        found.covariance[np.ix_(kept, kept)], old.covariance[np.ix_(before, before)]
    )
    fresh = instrument_of_files(rig, LOOSE, old.tip_pen, TIP, old.sigma).covariance
    others = np.r_[(*at.cameras, at.extrinsics)]
    np.testing.assert_array_equal(
        found.covariance[np.ix_(others, others)], fresh[np.ix_(others, others)]
    )
    assert not found.covariance[np.ix_(others, kept)].any()
    assert (found.rig, found.pen, found.sigma) == (rig, old.pen, old.sigma)
    np.testing.assert_array_equal(found.tip_pen, old.tip_pen)


def test_a_camera_that_does_not_see_the_pen_counts_for_nothing() -> None:
    (detection,) = Holder(BOTH, PEN).still(Hold(), 1)
    lost = replace(detection, others=(unseen(PEN, Reason.EMPTY),))
    together = see_together(BOTH, PEN, lost)

    assert together.has_pose
    np.testing.assert_allclose(together.translation, detection.translation, atol=1e-6)
    assert not np.isfinite(together.rig_pixels[1]).any()


def test_what_only_the_second_camera_sees_is_in_the_frame_of_the_first() -> None:
    (detection,) = Holder(BOTH, PEN).still(Hold(), 1)
    lost = replace(unseen(PEN, Reason.EMPTY), others=detection.others)
    together = see_together(BOTH, PEN, lost)

    assert together.has_pose
    np.testing.assert_allclose(together.translation, detection.translation, atol=0.5)


def test_what_no_camera_sees_stays_unseen() -> None:
    nothing = unseen(PEN, Reason.EMPTY)
    together = see_together(BOTH, PEN, replace(nothing, others=(nothing,)))

    assert together.reason is Reason.EMPTY


def test_a_camera_alone_is_as_it_is() -> None:
    (detection,) = Holder(rig_of(BOTH.cameras[0]), PEN).still(Hold(), 1)
    assert see_together(rig_of(BOTH.cameras[0]), PEN, detection) is detection
