"""A mask that is clicked together."""

import numpy as np

from lightpen.detection.inspection import clicked, stray_light, with_circle
from lightpen.detection.spots import Spots

NO_MASK = np.zeros((0, 3))
CENTERS = np.array([[100.0, 50.0], [300.0, 80.0]])
SPOTS = Spots(
    centers=CENTERS,
    shapes=np.tile(4.0 * np.eye(2), (2, 1, 1)),  # 4 px of radius
    areas=np.full(2, 16 * np.pi),
    contrasts=np.full(2, 0.6),
    edge_widths=np.full(2, 2.0),
    flaws=np.zeros(2, dtype=np.int64),
    sigmas=np.full(2, 0.01),
    offsets=np.zeros((2, 2)),
)


def test_a_click_beside_a_spot_puts_a_circle_over_all_of_it() -> None:
    mask = clicked(NO_MASK, SPOTS, CENTERS[1] + [3.0, 4.0])

    np.testing.assert_array_equal(mask, stray_light(SPOTS)[1:])
    assert mask[0, 2] > 4.0


def test_a_click_into_circles_takes_these_away() -> None:
    mask = with_circle(stray_light(SPOTS), np.array([101.0, 50.0, 20.0]))

    np.testing.assert_array_equal(
        clicked(mask, SPOTS, CENTERS[0]), stray_light(SPOTS)[1:]
    )


def test_a_click_on_the_dark_changes_nothing() -> None:
    dark = np.array([200.0, 65.0])

    assert len(clicked(NO_MASK, SPOTS, dark)) == 0
    assert len(clicked(NO_MASK, Spots.none(), dark)) == 0
