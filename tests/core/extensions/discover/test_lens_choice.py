from dataclasses import replace

import numpy as np
import pytest
from tests import simulated_stations
from tests.simulated_stations import errors_of, random_station, seen_station

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.camera import lens_model_of
from lightpen.model.rigid import rig_of
from lightpen_extensions.boards.distortion import Choice
from lightpen_extensions.discover.found import require_lens
from lightpen_extensions.discover.scaled_start import choose_lens, convert_lens
from lightpen_extensions.discover.starts import KnownLength, adjust_start, any_camera

STATION = random_station(0, n_images=48)
BROWN = [-0.2, 0.05, 2e-4, 1e-4, 0.0]
FISHEYE = [-0.03, 0.01, -0.004, 0.001]
SHARE = 0.6  # of the focal length: the lens is wide, the pen seen as large as before


def chosen(distortion: list[float]) -> tuple[Choice, float]:
    """Return the choice for a lens, and the focal length then, over the true one."""
    camera, swing = STATION.camera, STATION.swing
    camera = replace(
        camera,
        fx=SHARE * camera.fx,
        fy=SHARE * camera.fx,
        distortion=np.array(distortion),
        lens=lens_model_of(len(distortion)),
    )
    cone = swing.cone_cam * [1, 1, SHARE]
    swing = replace(
        swing, cone_cam=cone, translations=cone - swing.rotations @ swing.tip_pen
    )
    rng = np.random.default_rng(1)
    pixels: FloatArray = seen_station(camera, STATION.pen, swing, 0.03, 0.0, rng).pixels
    near = convert_lens(camera, 5)
    assert near is not None
    state = BundleState(rig_of(near), STATION.pen, swing.tip_pen, cone, swing.rotations)
    leds = STATION.pen.leds
    length = float(np.linalg.norm(leds[0] - leds[1]))
    lengths = (KnownLength(0, 1, length, 1e-3),)
    start = adjust_start(state, pixels, any_camera(near), 20, lengths)
    state, choice = choose_lens(start, pixels, lengths)
    return choice, state.rig.cameras[0].fx / camera.fx


def test_five_coefficients_stay_where_they_suffice() -> None:
    choice, focal = chosen(BROWN)
    assert choice.n_coefficients == 5
    assert focal == pytest.approx(1, abs=1e-3)


def test_a_lens_that_five_coefficients_do_not_describe_is_given_another_model() -> None:
    choice, focal = chosen(FISHEYE)
    assert choice.n_coefficients in {4, 8}
    assert choice.held_out[choice.n_coefficients] < 0.8 * choice.held_out[5]
    assert focal == pytest.approx(1, abs=1e-3)


def test_a_lens_that_folds_the_corners_is_refused_with_advice() -> None:
    require_lens(STATION.camera)
    folding = replace(STATION.camera, distortion=np.array([-9.0, 0.0, 0.0, 0.0, 0.0]))
    with pytest.raises(CalibrationError, match="into the corners"):
        require_lens(replace(folding, fx=2000.0, fy=2000.0))


@pytest.mark.slow
def test_a_lens_seen_far_from_the_corners_is_found_within_its_uncertainty(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(simulated_stations, "FILLED", 0.3)  # far from the corners
    station = random_station(29, n_images=150)
    found = station.discovered()
    require_lens(found.camera)
    assert (np.abs(errors_of(found, station).tip) < found.expanded_uncertainty).all()
