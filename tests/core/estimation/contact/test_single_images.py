"""Which images of one camera take part, and the words for too few of them."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import observe_pixels, simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.causes import UNKNOWN_CAUSE
from lightpen.detection.observations import Observations
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.estimation.contact.single_images import (
    PosedImages,
    pose_images,
    require_fit,
    require_images,
)
from lightpen.messages import Message, message
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA, PEN = paper_camera(), paper_pen()
SWING = swing_poses(24, np.random.default_rng(1))


def observed(moves: FloatArray | float = 0.0, sigma: float = 0.01) -> Observations:
    pixels = simulate_centers(
        CAMERA,
        PEN,
        *(SWING.rotations, SWING.translations + moves, sigma),
        np.random.default_rng(2),
    )
    return observe_pixels(pixels, CAMERA, PEN)


def with_slips(distance: float, width: float) -> PosedImages:
    """Pose images of which one of a wide edge slipped, and one of no known edge."""
    moves = np.zeros((24, 3))
    moves[[5, 9], 0] = distance
    widths = np.full(24, 2.0)
    widths[5], widths[9] = width, np.nan
    return pose_images(CAMERA, PEN, replace(observed(moves), edge_widths=widths))


@pytest.mark.parametrize(
    ("distance", "width", "reason"),
    [
        (0.12, 2.6, Reason.BLURRED),
        (0.12, 2.4, Reason.SLIPPED),
        (0.19, 2.6, Reason.SLIPPED),
    ],
)
def test_a_tip_that_is_a_little_off_in_a_blurred_image_did_not_slip(
    distance: float, width: float, reason: Reason
) -> None:
    posed = with_slips(distance, width)

    assert posed.reasons[5] is reason
    assert posed.reasons[9] is Reason.SLIPPED
    assert posed.fitted.tolist() == list(range(24))
    kept = [i for i in range(24) if i not in (5, 9)]
    assert posed.kept.tolist() == posed.chosen.tolist() == kept


def test_without_edges_a_tip_that_is_off_slipped() -> None:
    moves = np.zeros((24, 3))
    moves[5, 0] = 0.12
    assert pose_images(CAMERA, PEN, observed(moves)).reasons[5] is Reason.SLIPPED


@pytest.mark.parametrize(
    ("n_seen", "n_wrong", "fits"),
    [(10, 2, True), (4, 0, True), (10, 5, False), (6, 3, False), (5, 2, False)],
)
def test_most_leds_of_an_image_and_four_must_agree_with_its_pose(
    n_seen: int, n_wrong: int, fits: bool
) -> None:
    seen = observed()
    pixels = seen.pixels.copy()
    pixels[3, n_seen:] = np.nan
    away = np.array([[9, 7], [-8, 9], [7, -9], [-9, -8], [8, 8]])[:n_wrong]
    pixels[3, :n_wrong] += 4.0 * away
    posed = pose_images(CAMERA, PEN, replace(seen, pixels=pixels))

    assert (posed.reasons[3] is Reason.NONE) == fits
    if not fits:
        assert posed.reasons[3] is Reason.MISFIT
        assert 3 not in posed.fitted


@pytest.mark.parametrize("sigma", [0.99, 1.01])
def test_leds_that_are_off_by_more_than_a_pixel_are_refused(sigma: float) -> None:
    nothing_seen = np.full((6, 10, 2), np.nan)
    if sigma < 1:
        require_fit(sigma, CAMERA, PEN, nothing_seen)
        return
    with pytest.raises(CalibrationError) as info:
        require_fit(sigma, CAMERA, PEN, nothing_seen)
    values = {"sigma": 1.01, "usual": 0.1, "cause": UNKNOWN_CAUSE}
    assert info.value.message.values == values


@pytest.mark.parametrize(
    ("sigma", "code"),
    [(0.05, "pivot.tip-moved"), (0.2, "calibrate.leds-do-not-fit-nor-tip")],
)
def test_a_tip_that_moved_is_told_from_leds_that_do_not_fit(
    sigma: float, code: str
) -> None:
    moves = 8 * np.random.default_rng(3).standard_normal((24, 3))
    with pytest.raises(CalibrationError) as info:
        pose_images(CAMERA, PEN, observed(moves, sigma))

    assert info.value.message.code == code
    if sigma == 0.2:
        assert info.value.message.values["usual"] == 0.1


ADVICE = message("calibrate.capture-more")


@pytest.mark.parametrize("advice", [None, message("pose.mirrored")])
def test_too_few_images_are_told_with_what_the_others_lack(
    advice: Message | None,
) -> None:
    reasons = np.array(5 * [Reason.NONE] + 3 * [Reason.EMPTY] + 2 * [Reason.SLIPPED])
    require_images(np.arange(6), reasons, advice)
    with pytest.raises(CalibrationError) as info:
        require_images(np.arange(5), reasons, advice)

    found = info.value.message
    assert found.code == "calibrate.too-few-images"
    assert found.values["needed"] == 6
    assert found.values["advice"] == (advice or ADVICE)
    usable = found.values["usable"]
    assert isinstance(usable, Message)
    assert usable.values["usable"] == message(
        "calibrate.images-usable", n_usable=5, n_images=10
    )
    assert len(tuple(usable.parts())) > 3
    with pytest.raises(CalibrationError) as info:
        require_images(np.arange(5), reasons[:5], advice)
    assert info.value.message.values["usable"] == message(
        "calibrate.images-usable", n_usable=5, n_images=5
    )
