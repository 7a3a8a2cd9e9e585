"""A step in the middle of a swing: its image, kind and size."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import calibrate_pixels, observe_pixels, simulate_centers
from tests.simulated_swings import SwingKind, swing_of_kind

from lightpen.arrays import FloatArray
from lightpen.detection.observations import leave_out
from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.verdict import Grade, NextStep, judge
from lightpen.messages import Code
from lightpen.model.limits import SwingLimits
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA, PEN = paper_camera(), replace(paper_pen(), led_sigma=0.002)
N, FIRST = 100, 62
LIMITS = SwingLimits(max_uncertainty=0.05)


def swung(
    kind: str, shift: FloatArray, seed: int = 0, motion: SwingKind = "field"
) -> Calibration:
    """Calibrate a swing with a step before the image ``FIRST`` (from 0)."""
    rng = np.random.default_rng(seed)
    swing = swing_of_kind(N, rng, motion)
    R, t = swing.rotations.copy(), swing.translations.copy()
    if kind == "tip":
        t[FIRST:] -= R[FIRST:] @ shift
    elif kind == "cone":
        t[FIRST:] += shift
    elif kind == "camera":
        turn = rotation_from_vector(shift)
        R[FIRST:], t[FIRST:] = turn @ R[FIRST:], t[FIRST:] @ turn.T
    elif kind == "approach":
        n = FIRST // 3
        t[:n] += np.linspace(1, 0, n, endpoint=False)[:, None] * shift
    elif kind == "drift":
        t += np.linspace(-0.5, 0.5, N)[:, None] * shift
    pixels = simulate_centers(CAMERA, PEN, R, t, 0.03, rng)
    return calibrate_pixels(pixels, CAMERA, PEN)


@pytest.mark.parametrize(
    ("kind", "shift"),
    [
        ("tip", [0.03, 0.0, -0.02]),
        ("tip", [0.1, 0.0, 0.0]),
        ("cone", [0.02, 0.0, 0.0]),
        ("cone", [0.3, 0.0, 0.4]),
        ("camera", [5e-5, 0.0, 0.0]),
    ],
)
def test_a_step_is_found_with_its_image_and_kind(kind: str, shift: list[float]) -> None:
    found = swung(kind, np.array(shift))

    assert found.step is not None
    assert abs(found.step.first - FIRST) <= 3
    assert found.step.is_tip is (kind == "tip")
    size = float(np.linalg.norm(shift))
    if kind != "camera":
        assert found.step.size == pytest.approx(size, rel=0.1, abs=0.005)
    verdict = judge(found, LIMITS)
    assert (verdict.grade, verdict.reason.code) == (Grade.REPEAT, Code.STEP)
    assert verdict.next_step is NextStep.USE_PART
    assert verdict.reason.values["begin"] == 1
    assert verdict.reason.values["end"] == found.step.first


@pytest.mark.parametrize("seed", range(3))
def test_a_large_step_is_found_on_the_path_of_a_hand(seed: int) -> None:
    found = swung("cone", np.array([0.2, -0.26, 0.37]), seed, "operator")

    assert found.step is not None
    assert (found.step.first, found.step.is_tip) == (FIRST, False)
    assert judge(found, LIMITS).reason.code == Code.STEP


@pytest.mark.parametrize("seed", range(4))
def test_a_good_swing_has_no_step(seed: int) -> None:
    assert swung("none", np.zeros(3), seed).step is None


def test_a_slow_drift_is_no_step() -> None:
    assert swung("drift", np.array([0.03, 0.0, 0.02])).step is None


@pytest.mark.parametrize("shift", [[0.0, 0.0, -100.0], [5.0, 0.0, 0.0]])
def test_the_way_of_the_tip_to_the_cone_is_no_step(shift: list[float]) -> None:
    assert swung("approach", np.array(shift)).step is None


def test_the_longer_part_alone_gives_the_tip() -> None:
    rng = np.random.default_rng(5)
    swing = swing_poses(N, rng)
    t = swing.translations.copy()
    t[FIRST:] -= swing.rotations[FIRST:] @ np.array([0.05, 0.0, 0.0])
    pixels = simulate_centers(CAMERA, PEN, swing.rotations, t, 0.03, rng)
    seen = observe_pixels(pixels, CAMERA, PEN)
    step = calibrate(CAMERA, PEN, seen).step
    assert step is not None
    begin, end = step.longer_part(N)
    outside = {i: Reason.OUTSIDE for i in range(N) if not begin <= i + 1 <= end}

    part = calibrate(CAMERA, PEN, leave_out(seen, outside))

    assert part.step is None
    error = np.abs(part.joint.tip_pen - swing.tip_pen)
    assert (error < part.budget.expanded_uncertainty[:3]).all()
    assert judge(part, LIMITS).grade is Grade.PASS
