"""A displaced LED leaves two frames, and both tips are reported."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.reports.summary import calibration_text
from lightpen.estimation.reports.verdict import judge
from lightpen.formats.observation_files import Centers
from lightpen.model.limits import SwingLimits
from lightpen.model.rigid import fit_rigid
from lightpen.simulator.swings import (
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
MOVED = np.array([0.3, 0.0, 0.2])  # mm, of LED 9 since its file was made


def test_a_displaced_led_leaves_two_frames() -> None:
    rng = np.random.default_rng(262)
    swing = swing_poses(60, rng)
    leds = PEN.leds.copy()
    leds[8] += MOVED
    true = replace(PEN, leds=leds)
    pixels = simulate_centers(
        CAMERA, true, swing.rotations, swing.translations, 0.02, rng
    )
    centers = Centers(np.arange(60), pixels, Path("simulated"))
    found = calibrate(CAMERA, PEN, observe_centers(centers, CAMERA, PEN))
    assert found.leds.displaced == (9,)
    frames = found.tip_frames
    assert frames is not None
    U = found.budget.expanded_uncertainty[:3]
    assert frames.is_of_file
    assert (np.abs(frames.of_file - swing.tip_pen) < U).all()
    R, t = fit_rigid(leds, PEN.leds)
    assert (np.abs(frames.of_all - (R @ swing.tip_pen + t)) < U).all()
    assert np.linalg.norm(frames.of_all - frames.of_file) > 0.015
    text = calibration_text(found, "joint", None, judge(found, SwingLimits()))
    assert "Result and U refer to the former." in text
    assert " ".join(f"{value:.4f}" for value in frames.of_all) in text
