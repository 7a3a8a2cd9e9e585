"""From images to observations: what is found, what is dropped and why."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.simulated_centers import observe_pixels

from lightpen.arrays import FloatArray, Image
from lightpen.detection.observations import (
    Observations,
    observe_centers,
    observe_images,
)
from lightpen.detection.pen_detection import detect_from_centers
from lightpen.detection.reasons import Reason
from lightpen.errors import FileError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.images import ImageSource
from lightpen.formats.observation_files import Centers
from lightpen.messages import message
from lightpen.model.ellipse import ellipse_centers
from lightpen_extensions.simulator.image_plans import ScenePlan, plan_scene, render_plan
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import leds_in_camera, paper_camera, paper_pen

CAMERA = paper_camera()
PEN = paper_pen()
SCENE = Scene(n_images=6, seed=3)


@pytest.fixture(scope="module")
def plan() -> ScenePlan:
    return plan_scene(SCENE)


@pytest.fixture(scope="module")
def images(plan: ScenePlan) -> list[Image]:
    return [render_plan(SCENE, image_plan) for image_plan in plan.image_plans]


def damaged() -> Image:
    raise FileError(message("image.cut-off", name="frame_2.png"))


def observe(loaders: list[Callable[[], Image]]) -> Observations:
    def open_all() -> Iterator[Callable[[], Image]]:
        return iter(loaders)

    names = tuple(f"frame_{i}.png" for i in range(len(loaders)))
    return observe_images(ImageSource(names, (), open_all), CAMERA, PEN)


def loader(image: Image) -> Callable[[], Image]:
    return lambda: image


def true_centers(plan: ScenePlan) -> FloatArray:
    swing = plan.swing
    return ellipse_centers(
        CAMERA,
        *leds_in_camera(PEN, swing.rotations, swing.translations),
        PEN.diameter / 2,
    )


def test_all_leds_of_clean_images_are_found_where_they_are(
    plan: ScenePlan, images: list[Image]
) -> None:
    found = observe([loader(image) for image in images])
    errors = found.pixels - true_centers(plan)

    assert found.reasons == (Reason.NONE,) * 6
    assert np.sqrt(np.mean(np.sum(errors**2, axis=2))) < 0.006
    assert found.advice is None


def test_images_that_cannot_be_used_are_named_with_their_reason(
    images: list[Image],
) -> None:
    dark = np.zeros((2048, 2448), dtype=np.uint8)
    small = images[0][:1000]
    smeared = np.asarray(cv2.blur(images[0], (1, 401)), dtype=np.uint8)
    loaders = [loader(image) for image in (*images, dark, small, smeared)]
    loaders.insert(2, damaged)

    found = observe(loaders)

    assert found.reasons[2] is Reason.UNREADABLE
    assert "cut off" in str(found.details[2])
    assert found.reasons[7] is Reason.EMPTY
    assert found.reasons[8] is Reason.WRONG_SIZE
    assert "2448 x 1000" in str(found.details[8])
    assert found.reasons[9] is Reason.BLURRED
    assert found.reasons.count(Reason.NONE) == 6
    assert np.isnan(found.pixels[[2, 7, 8, 9]]).all()


def test_images_of_another_camera_are_refused(images: list[Image]) -> None:
    half = images[0][::2, ::2]

    with pytest.raises(FileError, match=r"1224 x 1024.*made for 2448 x 2048"):
        observe([loader(half)] * 3)


def test_a_camera_file_that_states_binning_is_named_where_images_are_whole(
    images: list[Image], tmp_path: Path
) -> None:
    file = tmp_path / "ros.yaml"
    file.write_text(
        "image_width: 2448\nimage_height: 2048\nbinning_x: 2\nbinning_y: 2\n"
        "distortion_model: plumb_bob\ndistortion_coefficients: [0, 0, 0, 0, 0]\n"
        "camera_matrix: [4640, 0, 1231, 0, 4640, 1018, 0, 0, 1]\n"
    )
    source = ImageSource(("a",), (), lambda: iter([loader(images[0])]))

    with pytest.raises(FileError, match=r"states binning.*of 2448 x 2048 px"):
        observe_images(source, read_camera(file), PEN)


def test_a_bug_in_a_thread_is_not_swallowed() -> None:
    def broken() -> Image:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        observe([broken])


def test_progress_ends_at_one(images: list[Image]) -> None:
    fractions: list[float] = []
    source = ImageSource(
        ("a", "b"), (), lambda: iter([loader(images[0]), loader(images[1])])
    )
    observe_images(source, CAMERA, PEN, fractions.append, n_threads=2)

    assert fractions == [0.5, 1.0]


def test_given_centres_pass_through_and_few_leds_are_said_so(plan: ScenePlan) -> None:
    pixels = true_centers(plan)
    pixels[1, 3:] = np.nan
    found = observe_centers(
        Centers(np.arange(6) + 1, pixels, Path("centers.csv")), CAMERA, PEN
    )

    np.testing.assert_array_equal(found.pixels, pixels)
    assert found.names[0] == "frame 1"
    assert found.reasons[1] is Reason.TOO_FEW_LEDS
    np.testing.assert_allclose(
        found.translations[0], plan.swing.translations[0], atol=1.0
    )


def test_given_centres_show_the_same_alone_as_among_others(plan: ScenePlan) -> None:
    swing = plan.swing
    pixels = true_centers(plan)
    pixels[1] = np.nan
    pixels[2, 3:] = np.nan
    pixels[3] = CAMERA.pixels(np.zeros((PEN.n_leds, 2)))  # all at one place
    found = observe_centers(
        Centers(np.arange(6) + 1, pixels, Path("centers.csv")), CAMERA, PEN
    )
    alone = [
        detect_from_centers(CAMERA, PEN, *image)
        for image in zip(pixels, found.rotations, found.translations, strict=True)
    ]

    assert found.reasons == tuple(detection.reason for detection in alone)
    assert found.reasons[:4] == (
        *(Reason.NONE, Reason.EMPTY),
        *(Reason.TOO_FEW_LEDS, Reason.MISFIT),
    )
    for detection, translation in zip(alone[4:], swing.translations[4:], strict=True):
        np.testing.assert_allclose(detection.translation, translation, atol=0.01)


def test_a_given_centre_beyond_the_fold_of_the_distortion_is_not_seen(
    plan: ScenePlan,
) -> None:
    camera = replace(CAMERA, distortion=np.array([-1.3, 0, 0, 0, 0]))
    swing = plan.swing
    leds, normals = leds_in_camera(PEN, swing.rotations, swing.translations)
    pixels = ellipse_centers(camera, leds, normals, PEN.diameter / 2)
    pixels[0, 2] = 3.0  # px, a corner
    found = observe_centers(
        Centers(np.arange(6) + 1, pixels, Path("centers.csv")), camera, PEN
    )

    pixels[0, 2] = np.nan
    np.testing.assert_array_equal(found.seen_pixels, pixels)
    assert set(found.reasons) == {Reason.NONE}


def test_centres_of_a_larger_image_are_refused(plan: ScenePlan) -> None:

    with pytest.raises(FileError, match="made for 2448 x 2048"):
        observe_pixels(3 * true_centers(plan), CAMERA, PEN)


def test_an_image_given_twice_counts_once(images: list[Image]) -> None:
    again = cv2.imencode(".jpg", images[1], [cv2.IMWRITE_JPEG_QUALITY, 100])[1]
    packed: Image = np.asarray(cv2.imdecode(again, cv2.IMREAD_GRAYSCALE), np.uint8)
    given = [*images, images[0], packed]
    found = observe([loader(image) for image in given])

    assert found.reasons == (Reason.NONE,) * 6 + (Reason.COPY,) * 2
    assert found.details[6] == message("image.copy-of", name="frame_0.png")
    assert found.details[7] == message("image.copy-of", name="frame_1.png")


def test_two_images_of_a_pen_at_rest_count_twice(plan: ScenePlan) -> None:
    still = plan.image_plans[0]
    shown = [render_plan(SCENE, replace(still, index=index)) for index in range(3)]
    assert observe([loader(image) for image in shown]).reasons == (Reason.NONE,) * 3


def test_leds_that_are_too_small_are_reported_with_what_is_needed() -> None:
    scene = replace(
        SCENE,
        pen=replace(PEN, diameter=0.5),
        optics=replace(SCENE.optics, psf_sigma=0.6),
    )
    plans = plan_scene(scene).image_plans[:3]
    found = observe([loader(render_plan(scene, each)) for each in plans])

    assert found.reasons == (Reason.TOO_SMALL,) * 3
    assert found.advice is not None
    assert found.advice.code == "images.too-small"
    assert "at least 4 px are needed" in str(found.advice)


def test_centres_counted_from_another_corner_are_named(plan: ScenePlan) -> None:
    pixels = true_centers(plan) - [CAMERA.width, CAMERA.height]
    centers = Centers(np.arange(6), pixels, Path("a.csv"))
    with pytest.raises(FileError, match=r"reach from \(-\d+, -\d+\) to .* top left"):
        observe_centers(centers, CAMERA, PEN)
