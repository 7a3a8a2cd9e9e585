"""Images that no pen makes, but a broken sensor may: each is looked at or left out."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from tests.simulated_plans import live_plan

from lightpen.arrays import Image, IntArray
from lightpen.detection import observations
from lightpen.detection.labelling.labels import Labels, label_images
from lightpen.detection.observations import Observations, observe_images
from lightpen.detection.pen_detection import detect_pen
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import Spots
from lightpen.formats.images import ImageSource
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.image_plans import render_plan
from lightpen_extensions.simulator.scenes import Scene, Sensor

N_IMAGES = 600
N_FILES = 60
SEEN = (320, 384)  # height, width; large enough for the LEDs of the pen
SMALL = (72, 96)
LARGE = ((520, 90), (530, 540), (1030, 1040))  # are sampled coarsely at first
BITS = (8, 10, 12, 16)
RADII = (0.5, 1, 2, 5, 20, 200)  # px


def camera_of(height: int, width: int) -> Camera:
    """Return a camera whose images of that size show the whole pen."""
    focal_length = 1.9 * min(height, width)
    return Camera(
        width=width,
        height=height,
        fx=focal_length,
        fy=focal_length,
        cx=(width - 1) / 2,
        cy=(height - 1) / 2,
    )


CAMERA = camera_of(*SEEN)
SCENE = replace(Scene(), camera=CAMERA, sensor=Sensor(bits=16))
PEN = SCENE.pen
PEN_SEEN, PEN_MOVED = (render_plan(SCENE, live_plan(SCENE, i, 1 + i)) for i in (0, 1))


def ugly_image(rng: np.random.Generator, height: int, width: int) -> Image:
    """Return an image of random things: lines, bars, checkers, noise, discs, ramps."""
    bits = int(rng.choice(BITS))
    full = 2**bits - 1
    if (height, width) == SEEN:
        values = PEN_SEEN.astype(np.int64) * full // 65535
    else:
        grounds = [0, 1, full // 10, full // 2, full]
        values = np.full((height, width), int(rng.choice(grounds)))
    if rng.random() < 0.5:
        strength = int(full * rng.choice([0.004, 0.02, 0.1, 1.0])) + 2
        values += rng.integers(0, strength, (height, width))
    for _ in range(rng.integers(0, 6)):
        draw(values, full, rng)
    image: Image = np.clip(values, 0, full).astype(np.uint8 if bits == 8 else np.uint16)
    return image


def draw(values: IntArray, full: int, rng: np.random.Generator) -> None:
    """Draw one thing into an image, often at its border."""
    height, width = values.shape
    rows, columns = np.ogrid[:height, :width]
    y = int(rng.choice([0, 1, height - 1, height - 2, int(rng.integers(height))]))
    x = int(rng.choice([0, 1, width - 1, width - 2, int(rng.integers(width))]))
    thick = int(rng.choice([1, 1, 2, 3, 7, 40]))
    anything = int(rng.integers(full))
    value = int(rng.choice([0, full // 20 + 1, full // 2, full, anything]))
    match int(rng.integers(9)):
        case 0:
            values[y : y + thick] = value
        case 1:
            values[:, x : x + thick] = value
        case 2:
            values[y : y + thick, x : x + int(rng.integers(1, width))] = value
        case 3:
            values[y : y + int(rng.integers(1, height)), x : x + thick] = value
        case 4:
            values[:: thick + 1] = value
        case 5:
            values[(rows + columns) // thick % 2 == 0] = value
        case 6:
            values[rng.random(values.shape) < rng.choice([1e-4, 1e-2, 0.3])] = value
        case 7:
            radius, flatness = rng.choice(RADII), rng.choice([0.01, 1, 100])
            inside = (rows - y) ** 2 + flatness * (columns - x) ** 2 <= radius**2
            values[inside] = value
        case 8:
            values += (rows if rng.random() < 0.5 else columns) * full // width


def observed(*images: Image) -> Observations:
    names = tuple(map(str, range(len(images))))
    loaders = [partial(np.asarray, image) for image in images]

    return observe_images(ImageSource(names, (), partial(iter, loaders)), CAMERA, PEN)


@pytest.mark.slow
def test_no_ugly_image_is_beyond_the_live_way() -> None:
    before = None
    reasons = []
    for seed in range(N_IMAGES):
        rng = np.random.default_rng([9, seed])
        size = SEEN if seed % 40 == 0 else SMALL
        image = ugly_image(rng, *(LARGE[seed] if seed < len(LARGE) else size))
        detection = detect_pen(image, camera_of(*image.shape), PEN, before=before)
        reasons.append(detection.reason)
        before = detection if image.shape == SEEN else before

    assert Reason.UNHANDLED not in reasons
    assert {Reason.NONE, Reason.EMPTY, Reason.BLURRED, Reason.TOO_FEW_LEDS} <= {
        *reasons
    }


@pytest.mark.slow
def test_no_ugly_image_is_beyond_the_way_of_files() -> None:
    rngs = [np.random.default_rng([10, seed]) for seed in range(N_FILES)]

    found = observed(*(ugly_image(rng, *SEEN) for rng in rngs))

    assert len(found.reasons) == N_FILES
    assert Reason.UNHANDLED not in found.reasons
    assert Reason.NONE in found.reasons


# Where the program makes a mistake


def test_an_image_that_the_search_fails_on_is_left_out_with_its_reason() -> None:
    unforeseen: Any = PEN_SEEN.astype(np.float32)

    found = observed(PEN_SEEN, unforeseen, PEN_MOVED)

    assert found.reasons == (Reason.NONE, Reason.UNHANDLED, Reason.NONE)
    assert "float32" in str(found.details[1])
    assert found.details[0] is None
    assert detect_pen(unforeseen, CAMERA, PEN).reason is Reason.UNHANDLED


def test_an_image_that_labelling_fails_on_leaves_the_others_of_its_batch(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail_on_nothing(spots: list[Spots], camera: Camera, pen: Pen) -> list[Labels]:
        if any(len(found) == 0 for found in spots):
            raise ZeroDivisionError("no spots")
        return label_images(spots, camera, pen)

    monkeypatch.setattr(observations, "label_images", fail_on_nothing)

    found = observed(PEN_SEEN, np.zeros_like(PEN_SEEN), PEN_MOVED)

    assert found.reasons == (Reason.NONE, Reason.UNHANDLED, Reason.NONE)
    assert "ZeroDivisionError: no spots" in str(found.details[1])
