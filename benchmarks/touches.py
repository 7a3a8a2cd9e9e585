"""How often the ellipsoids of touches hold the true point: ``./run bench verify``.

Camera and LEDs differ from their files as the files say they may, tip and LEDs are
calibrated by a swing, then points are touched about the cone.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import calibrate
from lightpen.formats.observation_files import Centers
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.simulator.swings import (
    PAPER_CONE,
    paper_camera,
    paper_pen,
    perturbed_pen,
    simulate_centers,
    swing_poses,
)
from lightpen.verification.tasks.probed_point import (
    ProbingFrame,
    StillFrames,
    measure_touches,
)

N_IMAGES, N_FRAMES = 60, 5
SIGMA = 0.03  # px
LED_SIGMA = 0.002  # mm
ABOUT = 60.0  # mm from the cone, in each direction
CHI_SQUARE_95 = 7.815  # 3 degrees of freedom


def covered_share(n_calibrations: int, n_touches: int, seed: int) -> float:
    """Return the share of touches whose 95 % ellipsoid holds the true point."""
    rng = np.random.default_rng(seed)
    file = replace(paper_pen(), led_sigma=LED_SIGMA)
    inside = []
    for _ in range(n_calibrations):
        camera, pen = _true_camera(rng), _true_pen(file, rng)
        swing = swing_poses(N_IMAGES, rng, pen=pen, camera=camera)
        pixels = simulate_centers(
            camera, pen, swing.rotations, swing.translations, SIGMA, rng
        )
        centers = Centers(np.arange(1, N_IMAGES + 1), pixels, Path("simulated.csv"))
        seen = observe_centers(centers, paper_camera(), file)
        instrument = calibrate(paper_camera(), file, seen).instrument
        for _ in range(n_touches):
            place = PAPER_CONE + rng.uniform(-ABOUT, ABOUT, 3)
            held = swing_poses(1, rng, pen=pen, camera=camera, cone_cam=place)
            R = np.repeat(held.rotations, N_FRAMES, axis=0)
            t = np.repeat(held.translations, N_FRAMES, axis=0)
            images = simulate_centers(camera, pen, R, t, SIGMA, rng)
            frames = tuple(
                ProbingFrame(str(i), each[None], R[i], t[i])
                for i, each in enumerate(images)
            )
            (touch,) = measure_touches(instrument, [StillFrames(frames)])
            error = touch.point_cam - place
            covariance = touch.covariance(instrument)
            distance = float(error @ np.linalg.solve(covariance, error))
            inside.append(distance < CHI_SQUARE_95)
    return float(np.mean(inside))


def _true_camera(rng: np.random.Generator) -> Camera:
    file = paper_camera()
    assert file.covariance is not None
    d = rng.multivariate_normal(np.zeros(len(file.covariance)), file.covariance)
    return replace(
        file,
        fx=file.fx + d[0],
        fy=file.fy + d[1],
        cx=file.cx + d[2],
        cy=file.cy + d[3],
        distortion=file.distortion + d[4:],
    )


def _true_pen(file: Pen, rng: np.random.Generator) -> Pen:
    pen = perturbed_pen(file, LED_SIGMA, rng)
    middle = pen.leds.mean(axis=0)
    scale = 1 + (file.scale_sigma or 0.0) * rng.standard_normal()
    diameter = file.diameter + (file.diameter_sigma or 0.0) * rng.standard_normal()
    return replace(pen, leds=middle + scale * (pen.leds - middle), diameter=diameter)
