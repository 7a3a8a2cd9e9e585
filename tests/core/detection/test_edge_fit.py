"""Discs that are not evenly lit are found by their rims; a part missing is noticed."""

from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np
import pytest
from tests.simulated_disturbances import Finger
from tests.simulated_leds import Dome, Face, RealLeds, Ring, with_leds

from lightpen.arrays import FloatArray, Image
from lightpen.detection.edge_fit import EdgeFits, EdgeStarts, fit_edges
from lightpen.detection.labelling.constellation import UNWHOLE
from lightpen.detection.spots import SpotFlaw, Spots, detect_spots
from lightpen.model.ellipse import Ellipses, disc_images
from lightpen_extensions.simulator.image_plans import ImagePlan, plan_scene
from lightpen_extensions.simulator.render import Optics, render_view
from lightpen_extensions.simulator.scenes import Scene, expose
from lightpen_extensions.simulator.swings import leds_in_camera

N_IMAGES = 3
BESIDE = 15.0  # px, of a spot that is still that of a disc


@dataclass(frozen=True, eq=False)
class DisplayedImage:
    """A rendered image and the true discs in it."""

    image: Image
    discs: Ellipses


def scene(leds: str, diameter: float = 10.0, blur: float = 0.8) -> Scene:
    usual = Scene(n_images=N_IMAGES, seed=4, optics=Optics(psf_sigma=blur))
    pen = replace(usual.pen, diameter=diameter)
    return with_leds(replace(usual, pen=pen), leds)


def show(scene: Scene, plan: ImagePlan, *fingers: Finger) -> DisplayedImage:
    view = replace(plan.view, others=fingers)
    light = render_view(scene.camera, scene.pen, view, plan.optics)
    image = expose(light, scene.sensor, np.random.default_rng(plan.index))
    leds, normals = leds_in_camera(scene.pen, plan.rotation, plan.translation)
    radius = scene.pen.diameter / 2
    return DisplayedImage(image, disc_images(scene.camera, leds, normals, radius))


def with_faces(plan: ImagePlan, faces: tuple[Face, ...]) -> ImagePlan:
    return replace(plan, optics=replace(plan.optics, draw_leds=RealLeds(faces)))


@lru_cache(maxsize=8)
def shown(
    leds: str, diameter: float = 10.0, blur: float = 0.8
) -> tuple[DisplayedImage, ...]:
    wanted = scene(leds, diameter, blur)
    return tuple(show(wanted, plan) for plan in plan_scene(wanted).image_plans)


def nearest(spots: Spots, center: FloatArray) -> int | None:
    gaps = np.linalg.norm(spots.centers - center, axis=1)
    return int(gaps.argmin()) if len(gaps) and gaps.min() < BESIDE else None


def rims_of(one: DisplayedImage) -> EdgeFits:
    starts = EdgeStarts.anew(one.discs.centers + 0.6, 1.1 * one.discs.shapes)
    return fit_edges(one.image, starts)


@pytest.mark.parametrize(
    ("leds", "diameter", "blur"),
    [
        ("hot-spot", 10.0, 0.8),
        ("hot-spot", 5.0, 0.8),
        ("dome", 10.0, 0.8),
        ("dome", 5.0, 0.8),
        ("dome", 10.0, 2.0),
        ("ring", 10.0, 0.8),
        ("ring", 5.0, 0.8),
        ("halo", 10.0, 0.8),
        ("ghost", 10.0, 0.8),
    ],
)
def test_leds_as_they_are_have_their_centers_and_are_whole(
    leds: str, diameter: float, blur: float
) -> None:
    errors = []
    for one in shown(leds, diameter, blur):
        spots = detect_spots(one.image)
        assert len(spots) == len(one.discs.centers)
        assert not (spots.flaws & UNWHOLE).any()
        for center in one.discs.centers:
            which = nearest(spots, center)
            assert which is not None
            errors.append(spots.centers[which] - center)
    assert np.sqrt(np.mean(np.square(errors))) < 0.02


def test_a_ring_as_bright_all_round_is_measured_as_exactly_as_a_disc() -> None:
    errors: dict[str, list[FloatArray]] = {"even": [], "ring": []}
    for leds, of_these in errors.items():
        for one in shown(leds, 10.0, 0.8):
            spots = detect_spots(one.image)
            for center in one.discs.centers:
                which = nearest(spots, center)
                assert which is not None
                of_these.append(spots.centers[which] - center)
    even, ring = (np.sqrt(np.mean(np.square(e))) for e in errors.values())
    assert ring < 1.2 * even  # by its rim alone 1.9 times


@pytest.mark.parametrize("n_sides", [1, 2])
def test_a_thick_ring_that_is_brighter_at_some_sides_has_its_center(
    n_sides: int,
) -> None:
    rng, errors = np.random.default_rng(4), []
    fine = (np.arange(64 * 5) + 0.5) / 5 - 0.5
    for turn in np.linspace(0, 2, 30):
        center = 31 + rng.uniform(-2, 2, 2)
        x, y = np.meshgrid(fine - center[0], fine - center[1])
        light = 1 + 0.6 * np.cos(n_sides * (np.arctan2(y, x) - turn))
        light[np.abs(np.hypot(x, y) - 9.5) > 2.5] = 0
        blurred = cv2.GaussianBlur(light, (0, 0), 5).reshape(64, 5, 64, 5)
        levels = 10 + 90 * blurred.mean(axis=(1, 3)) + rng.normal(0, 1.2, (64, 64))
        spots = detect_spots(np.rint(levels).astype(np.uint8))
        errors.append(spots.centers[nearest(spots, center)] - center)
    # 0.018 px with the dark middle, as if it were the parabola of a dome.
    assert np.sqrt(np.mean(np.square(errors))) < 0.012


@pytest.mark.parametrize("leds", ["hot-spot", "dome"])
@pytest.mark.parametrize("blur", [0.8, 2.0])
def test_the_area_is_that_of_the_rim_however_blurred(leds: str, blur: float) -> None:
    ratios = []
    for one in shown(leds, 10.0, blur):
        spots = detect_spots(one.image)
        for center, shape in zip(one.discs.centers, one.discs.shapes, strict=True):
            which = nearest(spots, center)
            assert which is not None
            true_area = 4 * np.pi * np.sqrt(np.linalg.det(shape))
            ratios.append(spots.areas[which] / true_area)
    # A wrong disc diameter is recognised by it.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.005)
    assert np.std(ratios) < 0.01


def test_a_narrow_ring_about_a_black_middle_is_whole() -> None:
    wanted = scene("ring")
    plan = plan_scene(wanted).image_plans[0]
    rings = (Ring(inner=0.75, softness=0.05, middle=0.0),) * wanted.pen.n_leds
    one = show(wanted, with_faces(plan, rings))
    spots = detect_spots(one.image)
    assert not (spots.flaws & UNWHOLE).any()
    errors = [spots.centers[nearest(spots, c)] - c for c in one.discs.centers]
    assert np.sqrt(np.mean(np.square(errors))) < 0.01


def test_a_dome_without_light_at_its_rim_is_not_blurred_and_has_its_center() -> None:
    wanted = scene("dome")
    for plan in plan_scene(wanted).image_plans:
        domes = (Dome(height=1.0, darkening=1.0),) * wanted.pen.n_leds
        one = show(wanted, with_faces(plan, domes))
        spots = detect_spots(one.image)
        assert not (spots.flaws & (UNWHOLE | SpotFlaw.BLURRED)).any()
        errors = [spots.centers[nearest(spots, c)] - c for c in one.discs.centers]
        assert np.sqrt(np.mean(np.square(errors))) < 0.03


def test_the_rim_tells_the_blur_of_optics_and_pixel() -> None:
    rims = rims_of(shown("hot-spot")[0])
    # Pixel and interpolation widen the Gaussian: 1 / 12 and 1 / 6 px^2.
    assert rims.sigmas[0] == pytest.approx(np.sqrt(0.8**2 + 1 / 12 + 1 / 6), rel=0.06)


def test_the_rim_of_an_evenly_lit_disc_is_found_as_well() -> None:
    for one in shown("even"):
        rims = rims_of(one)
        assert rims.are_whole.all()
        np.testing.assert_allclose(rims.centers, one.discs.centers, atol=0.03)


def test_nothing_is_fitted_to_a_smear_or_to_darkness() -> None:
    y, x = np.mgrid[:120, :120]
    smear = np.exp(-((x - 60) ** 2 + (y - 60) ** 2) / 400.0)
    dark = np.zeros((120, 120), np.uint8)
    for image in ((200 * smear).astype(np.uint8), dark):
        start = EdgeStarts.anew(np.full((1, 2), 60.0), 60.0 * np.eye(2)[None])
        assert not fit_edges(image, start).are_whole.any()


@pytest.mark.parametrize("leds", ["even", "hot-spot", "dome"])
@pytest.mark.parametrize("sliver", [1.0, 3.0, 8.0])
def test_a_finger_over_an_led_as_it_is_is_reported(leds: str, sliver: float) -> None:
    wanted = scene(leds)
    plan = plan_scene(wanted).image_plans[0]
    discs = show(wanted, plan).discs
    rng = np.random.default_rng(6)
    covered = (1, 4, 7)
    fingers = []
    for led in covered:
        angle = rng.uniform(0, 2 * np.pi)
        outwards = np.array([np.cos(angle), np.sin(angle)])
        reach = 2 * np.sqrt(outwards @ discs.shapes[led] @ outwards)
        middle = discs.centers[led] + (reach - sliver + 40.0) * outwards
        fingers.append(Finger(middle, middle + outwards, radius=40.0, softness=0.7))
    spots = detect_spots(show(wanted, plan, *fingers).image)
    for led in covered:
        which = nearest(spots, discs.centers[led])
        assert which is not None
        assert SpotFlaw(int(spots.flaws[which])) & (SpotFlaw.CUT | SpotFlaw.MERGED)
