"""The kept images: one fit, whatever way they came in; slipped ones found."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers
from tests.simulated_swings import swing_of_kind

from lightpen.detection.observations import observe_centers
from lightpen.detection.pen_detection import detect_from_centers
from lightpen.estimation.calibrate import calibrate
from lightpen.formats.observation_files import Centers
from lightpen.model.camera import Camera
from lightpen.model.limits import USUAL
from lightpen.model.pen import Pen
from lightpen.model.rigid import rig_of
from lightpen.swing.capture.kept_images import (
    AcceptedImages,
    distance_unit,
    keep,
    kept_before,
    none_kept,
    without_slipped,
)
from lightpen_extensions.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
RIG = rig_of(CAMERA)


def centers(swing: Swing) -> np.ndarray:
    rng = np.random.default_rng(1)
    return simulate_centers(CAMERA, PEN, swing.rotations, swing.translations, 0.05, rng)


def grown(swing: Swing, pen: Pen = PEN) -> AcceptedImages:
    """Keep the images of a swing one by one, 0.1 s apart."""
    kept = none_kept(1, PEN.n_leds)
    for i, pixels in enumerate(centers(swing)):
        detection = detect_from_centers(
            *(CAMERA, PEN, pixels, swing.rotations[i], swing.translations[i])
        )
        kept = keep(RIG, pen, kept, detection, i + 1, 0.1 * i)
    return kept


def slipping(frames: list[int], offset: float) -> Swing:
    swing = swing_poses(40, np.random.default_rng(0))
    swing.translations[frames] += [offset, 0, 0]
    return swing


ASSUMED = replace(CAMERA, covariance=None)


@pytest.mark.parametrize(
    ("camera", "n_images"), [(CAMERA, 40), (CAMERA, 120), (ASSUMED, 40)]
)
def test_the_uncertainty_during_the_swing_is_that_of_the_verdict(
    camera: Camera, n_images: int
) -> None:
    swing = swing_poses(n_images, np.random.default_rng(3))
    pixels = centers(swing)
    most = n_images - 4
    kept = kept_before(
        *(rig_of(camera), PEN, np.arange(most), pixels[:most, None]),
        *(swing.rotations[:most], swing.translations[:most]),
    )
    for i in range(most, n_images):  # an image more adds its own alone
        detection = detect_from_centers(
            *(camera, PEN, pixels[i], swing.rotations[i], swing.translations[i])
        )
        kept = keep(rig_of(camera), PEN, kept, detection, i + 1, 0.1 * i)
    seen = observe_centers(
        Centers(np.arange(n_images), pixels, Path("simulated")), camera, PEN
    )
    budget = calibrate(camera, PEN, seen).budget
    assert budget.correlation_factor < 1.1
    together = kept_before(
        *(rig_of(camera), PEN, np.arange(n_images), pixels[:, None]),
        *(swing.rotations, swing.translations),
    )
    assert together.uncertainty == pytest.approx(budget.weakest_uncertainty, rel=0.01)
    # What fields of the images may be was found with the images until then.
    assert kept.uncertainty == pytest.approx(budget.weakest_uncertainty, rel=0.07)
    assert 0 < kept.predicted.floor < kept.uncertainty


def test_what_is_assumed_of_the_station_counts_during_the_swing() -> None:
    swing = swing_poses(40, np.random.default_rng(2))
    usual, worn = (
        kept_before(
            *(RIG, PEN, np.arange(40), centers(swing)[:, None]),
            *(swing.rotations, swing.translations, assumed),
        )
        for assumed in (USUAL, replace(USUAL, form_error=0.02))
    )
    assert worn.uncertainty > 2 * usual.uncertainty
    assert worn.predicted.floor > usual.predicted.floor


def test_kept_one_by_one_or_all_at_once_gives_the_same_tip() -> None:
    swing = swing_poses(30, np.random.default_rng(0))
    kept = grown(swing)
    together = kept_before(
        *(RIG, PEN, kept.numbers, kept.pixels), *(swing.rotations, swing.translations)
    )
    assert kept.joint is not None
    assert together.joint is not None
    np.testing.assert_allclose(kept.joint.tip_pen, together.joint.tip_pen, atol=1e-6)
    # Fields of the images are searched for anew as these grow by a tenth.
    np.testing.assert_allclose(kept.uncertainty, together.uncertainty, rtol=0.01)
    np.testing.assert_allclose(kept.misfits, together.misfits, rtol=1e-3)


@pytest.mark.slow
def test_uncertain_normals_count_from_image_to_image() -> None:
    swing = swing_poses(30, np.random.default_rng(0))
    kept = grown(swing, replace(PEN, normal_covariance=0.3**2 * np.eye(3)))

    assert grown(swing).uncertainty < kept.uncertainty < np.inf


def test_nothing_is_certain_before_the_postures_allow_a_joint_fit() -> None:
    kept = grown(swing_poses(7, np.random.default_rng(0)))
    assert kept.joint is None
    assert kept.uncertainty == np.inf
    assert kept.seat is not None
    assert len(kept.misfits) == 7
    upright = grown(swing_of_kind(20, np.random.default_rng(0), "upright"))
    assert upright.joint is None


@pytest.mark.slow
def test_slipped_images_are_left_out_and_no_others() -> None:
    out = [5, 6, 31]
    kept, numbers = without_slipped(RIG, PEN, grown(slipping(out, 0.5)))
    assert numbers == {6, 7, 32}
    assert not np.isin(kept.numbers, list(numbers)).any()
    clean = grown(slipping([], 0.0))
    assert without_slipped(RIG, PEN, clean)[1] == set()


@pytest.mark.slow
def test_images_from_before_a_slip_need_not_be_far_out() -> None:
    # Half out: between the two gates.
    kept = grown(slipping([38, 39], 0.06))
    _, sure = without_slipped(RIG, PEN, kept)
    _, suspected = without_slipped(RIG, PEN, kept, since=3.75)
    assert sure < suspected
    assert suspected <= {39, 40}


def test_images_from_before_an_interruption_are_from_before_any_slip() -> None:
    swing = slipping([38, 39], 0.06)
    kept = kept_before(
        *(RIG, PEN, np.arange(40), centers(swing)[:, None]),
        *(swing.rotations, swing.translations),
    )
    assert without_slipped(RIG, PEN, kept)[1] == set()
    assert without_slipped(RIG, PEN, kept, since=-1e9)[1] == set()


def test_an_image_that_the_fit_leaves_out_has_the_misfit_of_all_its_leds() -> None:
    kept = grown(slipping([], 0.0))
    assert kept.joint is not None
    used = kept.joint.used.copy()
    used[5] = False
    without = replace(kept, joint=replace(kept.joint, used=used))

    squares = np.sum(kept.joint.residuals[5] ** 2, axis=1)
    np.testing.assert_allclose(without.misfits[5], np.sqrt(squares.mean()))


@pytest.mark.slow
def test_a_tip_that_wobbles_throughout_costs_no_images() -> None:
    swing = swing_poses(60, np.random.default_rng(0))
    wobble = 0.15 * np.random.default_rng(2).standard_normal((60, 3))
    swing.translations[:] += wobble
    kept, numbers = without_slipped(RIG, PEN, grown(swing))
    assert distance_unit(kept) > 1.5
    assert len(numbers) <= 2


@pytest.mark.parametrize("n_images", [0, 1])
def test_hardly_any_images_do_no_harm(n_images: int) -> None:
    swing = swing_poses(3, np.random.default_rng(0))
    kept = kept_before(
        *(RIG, PEN, np.arange(n_images), centers(swing)[:n_images, None]),
        *(swing.rotations[:n_images], swing.translations[:n_images]),
    )
    assert len(kept) == n_images
    assert without_slipped(RIG, PEN, kept)[1] == set()
    assert distance_unit(kept) == 1.0


def test_u_is_predicted_anew_after_4_percent_more_images() -> None:
    swing = swing_poses(105, np.random.default_rng(2))
    pixels, poses = centers(swing), (swing.rotations, swing.translations)
    kept = kept_before(
        rig_of(CAMERA),
        PEN,
        np.arange(100),
        pixels[:100, None],
        swing.rotations[:100],
        swing.translations[:100],
    )
    found = [kept.uncertainty]
    for i in range(100, 105):
        detection = detect_from_centers(CAMERA, PEN, pixels[i], *(p[i] for p in poses))
        kept = keep(rig_of(CAMERA), PEN, kept, detection, i + 1, 0.1 * i)
        found.append(kept.uncertainty)
    assert len(set(found[:5])) == 1
    assert found[5] != found[4]
