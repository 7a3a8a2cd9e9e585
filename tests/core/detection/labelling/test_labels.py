"""Labels on scenes made of exact disc images plus noise, lamps and hidden LEDs."""

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.labelling import spots_at
from tests.simulated_pens import SAMPLE_PENS

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.labelling.causes import diagnose
from lightpen.detection.labelling.labels import Labels, label_images, label_spots
from lightpen.detection.pen_detection import PenDetection, follow_spots
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import SpotFlaw, Spots
from lightpen.model.camera import Camera
from lightpen.model.ellipse import disc_images
from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import flat_pen, paper_camera, paper_pen

CAMERA = paper_camera()
PEN = paper_pen()
NOISE = 0.03  # px
LED_NOISE = 0.01  # mm
FULL_TURN = 2 * np.pi

FOUR_LED_PEN = flat_pen("four", [(0, 0, 0), (60, 20, 0), (-50, 90, -25), (10, 150, 0)])
FIVE_LED_PEN = flat_pen(
    "five", [(0, 0, 0), (60, 20, 0), (-50, 90, -25), (10, 150, 0), (-40, 20, -20)]
)
PLANAR_SIX_LED_PEN = flat_pen(
    "planar",
    [(-25, 0, 0), (25, 15, 0), (-25, 75, 0), (25, 100, 0), (-10, 160, 0), (20, 180, 0)],
)
TWELVE_LED_PEN = flat_pen(
    "twelve",
    [
        (-25, 0, 0),
        (25, 15, 0),
        (-25, 75, 0),
        (25, 100, -20),
        (-10, 160, -20),
        (20, 180, 0),
        (0, 40, -30),
        (0, 125, -30),
        (-28, 115, 0),
        (28, 58, 0),
        (-30, 180, -10),
        (30, 140, 0),
    ],
)
HALF = [(-25, 0, 0), (25, 30, 0), (-25, 70, 0), (0, 10, -30), (25, 85, 0)]


def half_turn_pen(asymmetry: float) -> Pen:
    """Return a ten-LED pen that half a turn about z maps onto itself, nearly."""
    half = np.array(HALF, dtype=np.float64)
    leds = np.concatenate([half, np.array([0, 180, 0]) + half * np.array([-1, -1, 1])])
    leds = leds + np.random.default_rng(5).uniform(-asymmetry, asymmetry, leds.shape)
    return replace(flat_pen("half turn", HALF + HALF), leds=leds)


def hexagon_pen() -> Pen:
    angles = np.arange(6) * np.pi / 3
    return flat_pen("hexagon", [(70 * np.cos(a), 70 * np.sin(a), 0.0) for a in angles])


def mirror_pen(planar: bool) -> Pen:
    """Return a ten-LED pen that equals its mirror image, x to -x."""
    half = np.array(HALF, dtype=np.float64) + np.array([8.0, 0, 0])
    leds = np.concatenate([half, half * np.array([-1, 1, 1])])
    if planar:
        leds[:, 2] = 0
    return replace(flat_pen("mirror", HALF + HALF), leds=leds)


@dataclass(frozen=True, eq=False)
class View:
    """Spots of one image, and which of them each LED really is."""

    spots: Spots
    spot: IntArray
    R: FloatArray
    t: FloatArray


def random_pose(pen: Pen, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return a pose with all LEDs in the image, discs within 70 degrees of facing."""
    while True:
        tilt, direction = np.radians(40) * rng.random(), FULL_TURN * rng.random()
        axis = np.array([np.cos(direction), np.sin(direction), 0.0])
        roll = np.array([0, 0, rng.uniform(-np.pi, np.pi)])
        facing = np.diag([1.0, -1.0, -1.0])
        R = rotation_from_vector(tilt * axis) @ rotation_from_vector(roll) @ facing
        middle = rng.uniform([-150, -120, 850], [150, 120, 1300])
        t = middle - R @ pen.leds.mean(axis=0)
        leds = pen.leds @ R.T + t
        cosines = -np.sum(pen.normals @ R.T * leds, axis=1)
        cosines /= np.linalg.norm(leds, axis=1)
        pixels = CAMERA.project(leds)
        inside = np.all((pixels > 60) & (pixels < (2388, 1988)))
        if inside and cosines.min() > np.cos(np.radians(70)):
            return R, t


def random_view(
    rng: np.random.Generator,
    pen: Pen = PEN,
    n_missing: int = 0,
    n_lamps: int = 0,
    lamp_sizes: tuple[float, float] = (1.0, 1.0),
    broadening: float = 0.0,
) -> View:
    """Return a view with LEDs hidden and lamps, like LEDs or not, strewn among them."""
    R, t = random_pose(pen, rng)
    leds = pen.leds + rng.normal(0, LED_NOISE, pen.leds.shape)
    discs = disc_images(CAMERA, leds @ R.T + t, pen.normals @ R.T, pen.diameter / 2)
    seen = np.sort(rng.permutation(pen.n_leds)[n_missing:])
    centers = list(discs.centers[seen] + rng.normal(0, NOISE, (len(seen), 2)))
    shapes = list(discs.shapes[seen] * (1 + rng.normal(0, 0.005, (len(seen), 1, 1))))
    low, high = discs.centers.min(axis=0) - 80, discs.centers.max(axis=0) + 80
    while len(centers) < len(seen) + n_lamps:
        place = rng.uniform(low, high)
        if np.linalg.norm(np.array(centers) - place, axis=1).min() > 45:
            like = discs.shapes[rng.integers(pen.n_leds)]
            round_one = np.sqrt(np.linalg.det(like)) * np.eye(2)
            shape = like if rng.random() < 0.5 else round_one
            centers.append(place)
            shapes.append(shape * rng.uniform(*lamp_sizes) ** 2)
    order = rng.permutation(len(centers))
    spot = np.full(pen.n_leds, -1)
    spot[seen] = np.argsort(order)[: len(seen)]
    broad = np.array(shapes) + broadening * np.eye(2)
    return View(spots_at(np.array(centers)[order], broad[order]), spot, R, t)


def random_lamps(rng: np.random.Generator, n: int) -> Spots:
    """Return lamps of one size and shape, like the LEDs of a pen, strewn at random."""
    centers = rng.uniform((700, 300), (1700, 1700), (n, 2))
    angle = np.pi * rng.random()
    axes = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shape = 110 * axes @ np.diag([1.0, rng.uniform(0.6, 1)]) @ axes.T
    return spots_at(centers, np.tile(shape, (n, 1, 1)))


def outcome(labels: Labels, view: View) -> str:
    if labels.reason is not Reason.NONE:
        return str(labels.reason)
    labelled = labels.spot >= 0
    right = np.array_equal(labels.spot[labelled], view.spot[labelled])
    return "right" if right else "WRONG"


def outcomes(
    make: Callable[[np.random.Generator], View], pen: Pen, n: int, seed: int
) -> Counter[str]:
    rng = np.random.default_rng(seed)
    views = [make(rng) for _ in range(n)]
    labels = label_images([view.spots for view in views], CAMERA, pen)
    return Counter(map(outcome, labels, views))


def without_led(view: View, led: int) -> View:
    """Return the view with an LED hidden."""
    gone = view.spot[led]
    spots = spots_at(
        np.delete(view.spots.centers, gone, axis=0),
        np.delete(view.spots.shapes, gone, axis=0),
    )
    spot = view.spot - (view.spot > gone)
    spot[led] = -1
    return replace(view, spots=spots, spot=spot)


def with_lamp(view: View, beside: tuple[float, float]) -> View:
    """Return the view with a lamp some px beside the place of the first hidden LED."""
    led = int(np.flatnonzero(view.spot < 0)[0])
    leds, normals = PEN.leds @ view.R.T + view.t, PEN.normals @ view.R.T
    disc = disc_images(CAMERA, leds, normals, PEN.diameter / 2)
    spots = spots_at(
        np.vstack([view.spots.centers, disc.centers[led] + beside]),
        np.concatenate([view.spots.shapes, disc.shapes[led][None]]),
    )
    return replace(view, spots=spots)


def flawed(spots: Spots, which: int, flaw: SpotFlaw, shift: float = 0.0) -> Spots:
    """Return the spots with one of them flawed, its centre shifted by some px."""
    centers, flaws = spots.centers.copy(), spots.flaws.copy()
    centers[which] += shift
    flaws[which] = flaw
    return replace(spots, centers=centers, flaws=flaws)


# Clean images


def test_all_leds_of_clean_images_are_labelled() -> None:
    rng = np.random.default_rng(1)
    views = [random_view(rng) for _ in range(100)]
    labels = label_images([view.spots for view in views], CAMERA, PEN)
    for label, view in zip(labels, views, strict=True):
        assert label.reason is Reason.NONE
        np.testing.assert_array_equal(label.spot, view.spot)
        assert label.whole.all()


def test_exact_spots_give_the_exact_pose() -> None:
    R, t = random_pose(PEN, np.random.default_rng(2))
    discs = disc_images(CAMERA, PEN.leds @ R.T + t, PEN.normals @ R.T, 5.0)
    label = label_spots(spots_at(discs.centers, discs.shapes), CAMERA, PEN)
    # Distortion bends the ellipse, which the pinhole plane does not know: 1e-5 px.
    np.testing.assert_allclose(label.R, R, atol=1e-6)
    np.testing.assert_allclose(label.t, t, atol=1e-3)
    assert label.rms_px < 1e-3


def test_one_image_is_labelled_as_in_a_batch() -> None:
    rng = np.random.default_rng(3)
    views = [random_view(rng, n_missing=i % 4, n_lamps=i % 3) for i in range(12)]
    batch = label_images([view.spots for view in views], CAMERA, PEN)
    for label, view in zip(batch, views, strict=True):
        alone = label_spots(view.spots, CAMERA, PEN)
        np.testing.assert_array_equal(alone.spot, label.spot)
        np.testing.assert_allclose(alone.R, label.R, atol=1e-6)


def test_a_pen_seen_exactly_face_on_is_labelled() -> None:
    R, t = np.diag([1.0, -1.0, -1.0]), np.array([0.0, 90.0, 1000.0])
    discs = disc_images(CAMERA, PEN.leds @ R.T + t, PEN.normals @ R.T, 5.0)
    label = label_spots(spots_at(discs.centers, discs.shapes), CAMERA, PEN)
    np.testing.assert_array_equal(label.spot, np.arange(10))


def test_the_rms_is_that_of_the_noise() -> None:
    rng = np.random.default_rng(4)
    views = [random_view(rng) for _ in range(60)]
    labels = label_images([view.spots for view in views], CAMERA, PEN)
    # 0.03 px and 0.01 mm at some 4.3 px/mm, 14 of 20 degrees of freedom
    expected = np.hypot(NOISE, 4.3 * LED_NOISE) * np.sqrt(14 / 20)
    assert np.median([label.rms_px for label in labels]) == pytest.approx(
        expected, rel=0.15
    )


# Hidden LEDs and foreign lamps


@pytest.mark.parametrize("n_missing", [1, 2, 3, 4])
def test_hidden_leds_are_reported_missing(n_missing: int) -> None:
    rng = np.random.default_rng(10 + n_missing)
    views = [random_view(rng, n_missing=n_missing) for _ in range(60)]
    labels = label_images([view.spots for view in views], CAMERA, PEN)
    found = [
        (label, view)
        for label, view in zip(labels, views, strict=True)
        if label.reason is Reason.NONE
    ]
    assert len(found) >= 58
    for label, view in found:
        np.testing.assert_array_equal(label.spot, view.spot)


def test_hidden_leds_and_lamps_together_give_right_labels() -> None:
    def make(rng: np.random.Generator) -> View:
        return random_view(rng, PEN, int(rng.integers(1, 5)), int(rng.integers(1, 6)))

    found = outcomes(make, PEN, 150, seed=30)
    assert found["WRONG"] == 0
    assert found["right"] >= 147


def test_lamps_of_other_sizes_do_not_mislead() -> None:
    def make(rng: np.random.Generator) -> View:
        n_missing, n_lamps = int(rng.integers(0, 5)), int(rng.integers(1, 6))
        return random_view(rng, PEN, n_missing, n_lamps, lamp_sizes=(0.5, 1.6))

    found = outcomes(make, PEN, 80, seed=31)
    assert found["WRONG"] == 0
    assert found["right"] >= 78


def test_broadened_spots_are_labelled() -> None:
    found = outcomes(
        lambda rng: random_view(rng, n_missing=1, n_lamps=1, broadening=8.0),
        PEN,
        40,
        32,
    )
    assert found == {"right": 40}


def test_a_lamp_beside_the_place_of_a_hidden_led_is_not_labelled() -> None:
    rng = np.random.default_rng(33)
    for _ in range(20):
        view = with_lamp(random_view(rng, n_missing=3), (1.5, -1.0))
        label = label_spots(view.spots, CAMERA, PEN)
        assert label.reason is Reason.NONE
        np.testing.assert_array_equal(label.spot, view.spot)


# Refusals


def test_an_image_without_spots_is_refused() -> None:
    label = label_spots(spots_at(np.empty((0, 2)), np.empty((0, 2, 2))), CAMERA, PEN)
    assert label.reason is Reason.EMPTY
    assert (label.spot == -1).all()
    assert np.isnan(label.R).all()


def test_fewer_than_five_leds_are_refused() -> None:
    view = random_view(np.random.default_rng(40), n_missing=6)
    assert label_spots(view.spots, CAMERA, PEN).reason is Reason.TOO_FEW_LEDS


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "six", "eight", "near-symmetric"])
def test_five_leds_alone_are_labelled_if_they_fit_one_way_only(name: str) -> None:
    pen = SAMPLE_PENS[name]()
    n_missing = pen.n_leds - 5
    found = outcomes(lambda rng: random_view(rng, pen, n_missing), pen, 30, seed=46)
    assert set(found) <= {"right", str(Reason.TOO_FEW_LEDS), str(Reason.NOT_THE_PEN)}
    assert found["right"] >= 15


def test_four_leds_and_a_lamp_are_not_taken_for_five() -> None:
    found = outcomes(lambda rng: random_view(rng, PEN, 6, 1), PEN, 30, seed=47)
    assert found == {str(Reason.TOO_FEW_LEDS): 30}


@pytest.mark.slow
@pytest.mark.parametrize("n_lamps", [6, 10, 15, 30])
def test_lamps_without_a_pen_are_refused(n_lamps: int) -> None:
    rng = np.random.default_rng(41 + n_lamps)
    spots = [random_lamps(rng, n_lamps) for _ in range(10)]
    for pen in (PEN, FOUR_LED_PEN, FIVE_LED_PEN, PLANAR_SIX_LED_PEN):
        labels = label_images(spots, CAMERA, pen)
        assert {label.reason for label in labels} <= {
            Reason.NOT_THE_PEN,
            Reason.AMBIGUOUS,
        }


@pytest.mark.slow
def test_too_many_hidden_leds_are_not_made_up_for_by_lamps() -> None:
    def make(rng: np.random.Generator) -> View:
        return random_view(rng, PEN, int(rng.integers(5, 7)), int(rng.integers(2, 6)))

    found = outcomes(make, PEN, 30, seed=42)
    assert set(found) <= {str(Reason.NOT_THE_PEN), str(Reason.TOO_FEW_LEDS)}


def test_a_lamp_near_the_place_of_a_hidden_led_does_not_make_up_for_it() -> None:
    """With five LEDs and one lamp in their pattern, further lamps are a warning."""

    def make(rng: np.random.Generator) -> View:
        return with_lamp(random_view(rng, PEN, 5, 3), (0.8, -0.6))

    assert outcomes(make, PEN, 8, seed=44) == {str(Reason.NOT_THE_PEN): 8}


def test_five_leds_of_which_one_is_off_are_hardly_ever_believed() -> None:
    rng = np.random.default_rng(48)
    views = [random_view(rng, FIVE_LED_PEN) for _ in range(16)]
    spots = [flawed(view.spots, 0, SpotFlaw.NONE, shift=2.0) for view in views]
    labels = label_images(spots, CAMERA, FIVE_LED_PEN)
    # The pose of five follows the shift of one to 0.3 px at times.
    assert sum(label.reason is Reason.NOT_THE_PEN for label in labels) >= 14


def test_four_leds_that_chance_would_find_among_lamps_are_refused() -> None:
    found = outcomes(
        lambda rng: random_view(rng, FOUR_LED_PEN, 0, 16), FOUR_LED_PEN, 4, seed=45
    )
    assert found == {str(Reason.NOT_THE_PEN): 4}


def test_the_spots_of_another_pen_are_refused() -> None:
    views = outcomes(lambda rng: random_view(rng, TWELVE_LED_PEN), PEN, 15, seed=43)
    assert set(views) == {str(Reason.NOT_THE_PEN)}


def test_a_pen_of_fewer_than_four_leds_is_a_bug_of_the_caller() -> None:
    pen = flat_pen("three", [(0, 0, 0), (50, 0, 0), (0, 50, 0)])
    spots = random_lamps(np.random.default_rng(0), 6)
    with pytest.raises(ValueError, match="at least 4 LEDs"):
        label_spots(spots, CAMERA, pen)


# Other pens


@pytest.mark.parametrize(
    "pen",
    [
        FOUR_LED_PEN,
        FIVE_LED_PEN,
        PLANAR_SIX_LED_PEN,
        TWELVE_LED_PEN,
        mirror_pen(planar=False),
        mirror_pen(planar=True),
        *(make() for name, make in SAMPLE_PENS.items() if name != "paper"),
    ],
    ids=lambda pen: pen.name,
)
def test_pens_of_other_layouts_are_labelled(pen: Pen) -> None:
    assert outcomes(lambda rng: random_view(rng, pen), pen, 40, seed=50) == {
        "right": 40
    }


@pytest.mark.parametrize("name", ["eight", "near-symmetric", "fanned"])
def test_other_pens_stand_hidden_leds_and_lamps(name: str) -> None:
    pen = SAMPLE_PENS[name]()

    def make(rng: np.random.Generator) -> View:
        n_missing = int(rng.integers(1, pen.n_leds - 5))
        return random_view(rng, pen, n_missing, int(rng.integers(1, 5)))

    found = outcomes(make, pen, 60, seed=51)
    assert found["WRONG"] == 0
    assert found["right"] >= 57


def test_four_led_pens_are_right_or_refused_among_lamps() -> None:
    found = outcomes(
        lambda rng: random_view(rng, FOUR_LED_PEN, 0, 3), FOUR_LED_PEN, 60, 52
    )
    assert found["WRONG"] == 0
    assert found["right"] >= 30


@pytest.mark.parametrize(
    "pen", [half_turn_pen(0.0), hexagon_pen()], ids=["turn", "hexagon"]
)
def test_symmetric_pens_are_refused_as_ambiguous(pen: Pen) -> None:
    found = outcomes(lambda rng: random_view(rng, pen), pen, 30, seed=53)
    assert found == {str(Reason.AMBIGUOUS): 30}


@pytest.mark.parametrize("asymmetry", [0.01, 0.03, 0.1, 0.5, 2.0])
def test_nearly_symmetric_pens_are_right_or_refused(asymmetry: float) -> None:
    pen = half_turn_pen(asymmetry)

    def make(rng: np.random.Generator) -> View:
        return random_view(rng, pen, int(rng.integers(0, 5)), int(rng.integers(0, 4)))

    found = outcomes(make, pen, 60, seed=54)
    assert found["WRONG"] == 0
    if asymmetry >= 0.5:
        assert found["right"] >= 57


# Merged and cut spots


def test_a_cut_spot_is_labelled_but_not_whole() -> None:
    view = random_view(np.random.default_rng(60))
    spots = flawed(view.spots, int(view.spot[4]), SpotFlaw.CUT, shift=5.0)
    label = label_spots(spots, CAMERA, PEN)
    np.testing.assert_array_equal(label.spot, view.spot)
    np.testing.assert_array_equal(np.flatnonzero(~label.whole), [4])
    assert label.rms_px < 0.2


def test_spots_that_are_only_blurred_or_saturated_count_as_whole() -> None:
    view = random_view(np.random.default_rng(61))
    spots = flawed(view.spots, int(view.spot[4]), SpotFlaw.BLURRED | SpotFlaw.SATURATED)
    assert label_spots(spots, CAMERA, PEN).whole.all()


def test_merged_spots_are_the_last_resort() -> None:
    view = random_view(np.random.default_rng(62))
    spots = replace(view.spots, flaws=np.full(10, int(SpotFlaw.MERGED)))
    label = label_spots(spots, CAMERA, PEN)
    np.testing.assert_array_equal(label.spot, view.spot)
    assert not label.whole.any()


# LEDs displaced in the pen file


def test_an_led_that_is_always_beside_its_place_keeps_its_label() -> None:
    rng = np.random.default_rng(70)
    views = [random_view(rng) for _ in range(10)]
    displaced = PEN.leds.copy()
    displaced[6] += np.array([0.6, -0.4, 0.0])
    pen = replace(PEN, leds=displaced)
    labels = label_images([view.spots for view in views], CAMERA, pen)
    for label, view in zip(labels, views, strict=True):
        np.testing.assert_array_equal(label.spot, view.spot)
        assert label.rms_px < 0.2


@pytest.mark.parametrize(("n_images", "n_beside"), [(12, 5), (5, 4)])
def test_an_led_that_is_beside_its_place_in_some_images_is_not_displaced(
    n_images: int, n_beside: int
) -> None:
    rng = np.random.default_rng(71)
    views = [random_view(rng) for _ in range(n_images)]
    for i, view in enumerate(views[:n_beside]):
        views[i] = with_lamp(without_led(view, 6), (3.0, -2.0))
    labels = label_images([view.spots for view in views], CAMERA, PEN)
    for label, view in zip(labels, views, strict=True):
        np.testing.assert_array_equal(label.spot, view.spot)


# Tracking


def beside(
    view: View, pen: Pen, rng: np.random.Generator, px: float, rad: float
) -> View:
    """Return the view with its pose turned and shifted by so much."""
    turn = rng.normal(size=3)
    R = rotation_from_vector(rad * turn / np.linalg.norm(turn)) @ view.R
    angle = FULL_TURN * rng.random()
    middle = view.R @ pen.leds.mean(axis=0) + view.t
    shift = px * middle[2] / CAMERA.fx * np.array([np.cos(angle), np.sin(angle), 0])
    t = middle + shift + np.array([0, 0, 10.0]) - R @ pen.leds.mean(axis=0)
    return replace(view, R=R, t=t)


def followed(view: View, guess: View) -> Labels | None:
    unseen = np.full((PEN.n_leds, 2), np.nan)
    before = PenDetection(unseen, unseen, Reason.NONE, guess.R, guess.t)
    found = follow_spots(view.spots, CAMERA, PEN, before)
    return None if found is None else found.labels


def test_the_pose_before_leads_to_the_labels() -> None:
    rng = np.random.default_rng(80)
    found: Counter[str] = Counter()
    for _ in range(100):
        view = random_view(rng, PEN, int(rng.integers(0, 3)), int(rng.integers(0, 4)))
        label = followed(view, beside(view, PEN, rng, px=15, rad=0.04))
        found["none" if label is None else outcome(label, view)] += 1
    assert found["WRONG"] == 0
    assert found["right"] >= 98


def test_following_agrees_with_a_start_from_nothing() -> None:
    view = random_view(np.random.default_rng(81))
    start = label_spots(view.spots, CAMERA, PEN)
    label = followed(view, view)
    assert label is not None
    np.testing.assert_array_equal(label.spot, start.spot)


def test_five_leds_among_lamps_are_mostly_labelled_by_the_pose_before() -> None:
    rng = np.random.default_rng(83)
    found: Counter[str] = Counter()
    for _ in range(40):
        view = random_view(rng, PEN, 5, 3)
        label = followed(view, beside(view, PEN, rng, px=10, rad=0.02))
        found["none" if label is None else outcome(label, view)] += 1
    assert found["WRONG"] == 0
    assert found["right"] >= 28  # a lamp at a hidden LED spoils some


def test_a_pose_before_does_not_make_four_leds_and_lamps_five() -> None:
    rng = np.random.default_rng(84)
    for _ in range(20):
        view = random_view(rng, PEN, 6, 2)
        assert followed(view, beside(view, PEN, rng, px=10, rad=0.02)) is None


def test_a_pose_far_off_is_not_followed() -> None:
    rng = np.random.default_rng(82)
    for _ in range(30):
        view, other = random_view(rng), random_view(rng)
        label = followed(view, other)
        assert label is None or outcome(label, view) == "right"


# What is wrong with a whole set


def some_spots(n: int = 5) -> list[Spots]:
    rng = np.random.default_rng(90)
    return [random_view(rng).spots for _ in range(n)]


def test_nothing_is_diagnosed_where_the_pen_fits() -> None:
    assert diagnose(some_spots(), CAMERA, PEN) is None


@pytest.mark.parametrize(("axis", "name"), [(0, "x"), (2, "z")])
def test_a_mirrored_pen_file_is_named(axis: int, name: str) -> None:
    leds = PEN.leds.copy()
    leds[:, axis] *= -1
    advice = diagnose(some_spots(), CAMERA, replace(PEN, leds=leds))
    assert f"sign of {name}" in str(advice)


@pytest.mark.parametrize(("unit", "factor"), [(1000.0, "1000"), (25.4, "25.4")])
def test_a_pen_file_in_another_unit_is_named(unit: float, factor: str) -> None:
    advice = diagnose(some_spots(), CAMERA, replace(PEN, leds=PEN.leds / unit))
    assert f"times {factor} are mm" in str(advice)


def test_a_wrong_disc_diameter_is_named() -> None:
    advice = diagnose(some_spots(), CAMERA, replace(PEN, diameter=25.0))
    assert "0.4 times 25 mm" in str(advice)


def test_a_camera_file_of_another_lens_is_named() -> None:
    camera = replace(CAMERA, fx=0.5 * CAMERA.fx, fy=0.5 * CAMERA.fy)
    assert "times about 2" in str(diagnose(some_spots(), camera, PEN))


@pytest.mark.slow
def test_the_file_of_another_pen_is_named() -> None:
    assert "LED file belongs to this pen" in str(
        diagnose(some_spots(), CAMERA, TWELVE_LED_PEN)
    )


def test_images_with_too_few_spots_are_named() -> None:
    rng = np.random.default_rng(91)
    spots = [random_lamps(rng, 3) for _ in range(5)]
    assert "fewer than 6 spots (median 3)" in str(diagnose(spots, CAMERA, PEN))


# The independent renderer's truth


def true_spots(frame: dict[str, Any], order: IntArray) -> Spots:
    leds = [frame["leds"][led] for led in order]
    angles = np.radians([led["angle_deg"] for led in leds])
    axes = np.array([led["semi_axes"] for led in leds])
    along = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    across = np.stack([-np.sin(angles), np.cos(angles)], axis=-1)
    shapes = np.einsum("n,ni,nj->nij", axes[:, 0] ** 2 / 4, along, along)
    shapes += np.einsum("n,ni,nj->nij", axes[:, 1] ** 2 / 4, across, across)
    return spots_at(np.array([led["ellipse_center"] for led in leds]), shapes)


@pytest.mark.parametrize(("name", "n"), [("swing-clean", 60), ("swing-full", 300)])
def test_every_frame_of_the_rendered_swings_is_right(
    shared_data: Path, name: str, n: int
) -> None:
    truth = json.loads((shared_data / name / "truth.json").read_text())
    intrinsics = truth["camera"]
    camera = Camera(
        intrinsics["image_width"],
        intrinsics["image_height"],
        intrinsics["fx"],
        intrinsics["fy"],
        intrinsics["cx"],
        intrinsics["cy"],
        np.array([intrinsics[k] for k in ("k1", "k2", "p1", "p2", "k3")]),
    )
    measured = np.array(truth["pen"]["leds_measured_csv"])
    pen = replace(PEN, leds=measured)
    rng = np.random.default_rng(100)
    orders = [rng.permutation(10) for _ in truth["frames"]]
    spots = [true_spots(f, o) for f, o in zip(truth["frames"], orders, strict=True)]
    labels = label_images(spots, camera, pen)
    right = [
        np.array_equal(label.spot, np.argsort(order))
        for label, order in zip(labels, orders, strict=True)
    ]
    assert sum(right) == n
    for label, frame in zip(labels, truth["frames"], strict=True):
        np.testing.assert_allclose(label.R, np.array(frame["R"]), atol=5e-4)
