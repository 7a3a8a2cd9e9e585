"""Calibrations by swings that each have something beside noise: tip, U and record."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.small_records import entries_of
from tests.simulated_calibrations import SWINGS, true_tip

from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.reports.summary import calibration_text
from lightpen.estimation.reports.verdict import Grade, judge
from lightpen.estimation.uncertainty.prediction import predict_uncertainty
from lightpen.formats.opened_files import InputFile, Inputs
from lightpen.messages import Code
from lightpen.model.limits import USUAL, SwingLimits
from lightpen_extensions.simulator.swings import paper_pen

FILE = InputFile(Path("file"), 64 * "0")
INPUTS = Inputs(FILE, FILE, (FILE,), paper_pen().nominal_tip)
LIMITS = SwingLimits(max_uncertainty=0.05, min_images=12)
# Of these, files and pen are what their uncertainty says.
AS_STATED = (
    *("usual", "restless", "followed", "loose", "oval_seat"),
    "by_two_cameras",
    *(
        pytest.param(name, marks=pytest.mark.slow)
        for name in ("larger_discs", "by_a_late_camera")
    ),
)

Calibrated = Callable[[str], Calibration]


@pytest.fixture(scope="module")
def calibrated() -> Calibrated:
    """Return a function that calibrates by a swing, once."""
    done: dict[str, Calibration] = {}

    def found(name: str) -> Calibration:
        return done.setdefault(name, SWINGS[name]()) if name not in done else done[name]

    return found


@pytest.mark.parametrize("name", AS_STATED)
def test_u_covers_the_error_of_the_tip(name: str, calibrated: Calibrated) -> None:
    found = calibrated(name)
    error = np.abs(found.joint.tip_pen - true_tip(name))

    # One in twenty may lie beyond U, by half of it one in four hundred.
    assert (error < 1.5 * found.budget.expanded_uncertainty[:3]).all()
    assert found.budget.expanded_uncertainty[:3].max() < 0.15


@pytest.mark.slow
def test_a_late_camera_is_named(calibrated: Calibrated) -> None:
    verdict = judge(calibrated("by_a_late_camera"), LIMITS)

    assert (verdict.grade, verdict.reason.code) == (Grade.CHECK, Code.NOT_SIMULTANEOUS)
    assert verdict.reason.values["camera"] == "right"


def recorded(calibration: Calibration) -> dict[str, Any]:
    return entries_of(calibration_record(calibration, INPUTS, LIMITS))


def text_of(calibration: Calibration) -> str:
    verdict = judge(calibration, LIMITS)
    return calibration_text(calibration, INPUTS.nominal_tip, verdict)


def test_the_text_has_the_lamps_that_were_followed(calibrated: Calibrated) -> None:
    found = calibrated("followed")
    path = found.cameras[0].path
    assert path is not None
    assert path.is_followed

    text = text_of(found)
    assert f"2 in view; moved by {path.moved:.2f} px, which is corrected" in text


def test_record_and_text_have_the_discs_that_areas_tell(calibrated: Calibrated) -> None:
    found = calibrated("followed")
    reading = found.priors.reading
    assert reading is not None

    estimate = recorded(found)["adjusted"]["disc_diameter_by_areas_mm"]
    assert estimate["value"] == reading.value
    assert estimate["standard_uncertainty"] == reading.sigma
    assert f"{reading.value:.2f} mm wide by their areas" in text_of(found)


def test_the_record_has_the_noisy_led(calibrated: Calibrated) -> None:
    found = calibrated("uneven")
    (led_noise,) = [
        each for each in recorded(found)["warnings"] if each["code"].endswith("-noise")
    ]
    assert led_noise["values"]["led"] == 4


def test_the_text_names_images_left_out_of_each_camera(calibrated: Calibrated) -> None:
    found = calibrated("by_two_cameras")
    text = text_of(found)

    for images in found.cameras:
        assert f"{images.used.sum()} of " in text
    dropped = found.cameras[1]
    assert "stands" in text
    assert dropped.used.sum() < 25


@pytest.mark.parametrize("name", ["usual", "restless"])
def test_u_predicted_from_linear_equations_is_that_of_the_calibration(
    name: str, calibrated: Calibrated
) -> None:
    found = calibrated(name)
    pixels = found.observations.pixels[found.used][:, None]
    state, joint = found.bundle.state, found.joint
    prediction = predict_uncertainty(
        state.rig, state.pen, pixels, joint, joint.sigma, USUAL
    )

    ratio = prediction.uncertainty / found.budget.expanded_uncertainty[:3].max()
    # One linear step knows the seat less well, and too much is said rather than less.
    assert 0.8 < ratio < 1.8


@pytest.mark.parametrize("name", ["restless", "usual", "loose"])
def test_errors_of_trials_are_what_u_says(name: str, calibrated: Calibrated) -> None:
    from lightpen_extensions.comparisons.monte_carlo import run_trial, trials_of

    found = calibrated(name)
    trials = trials_of(found)
    errors = np.array([run_trial(trials, number) for number in range(4)])

    ratios = errors[:, :3] / (found.budget.expanded_uncertainty[:3] / 2)
    # Twelve of unit variance, which hang together; trials know no drift.
    assert 0.2 < np.sqrt(np.mean(ratios**2)) < 2
