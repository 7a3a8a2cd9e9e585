"""What views of a board have shown of the camera."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.intrinsics.coverage import cover
from lightpen.intrinsics.start import BoardPoses
from lightpen.intrinsics.views import Views
from lightpen.model.rigid import rotation_from_vector

N_VIEWS = 4
FAR = np.tile([0.0, 0.0, 600.0], (N_VIEWS, 1))
SIDES = ["right", "down", "left", "up"]


@pytest.mark.parametrize("side", SIDES)
def test_a_tilted_board_faces_the_side_to_which_it_is_turned(
    make_views: Callable[..., Views], side: str
) -> None:
    facing = {"right": [1, 0], "down": [0, 1], "left": [-1, 0], "up": [0, -1]}[side]
    # A board that faces the camera looks along -z: turned about z x side, it looks to
    # that side.
    turn = -0.4 * np.cross([0, 0, 1], [*facing, 0])
    rotations = np.tile(rotation_from_vector(turn), (N_VIEWS, 1, 1))
    np.testing.assert_allclose(-rotations[0, :2, 2], np.sin(0.4) * np.array(facing))

    coverage = cover(make_views(n_views=N_VIEWS), BoardPoses(rotations, FAR))

    np.testing.assert_allclose(coverage.tilts, 0.4)
    np.testing.assert_array_equal(coverage.tilted, N_VIEWS * np.equal(SIDES, side))
