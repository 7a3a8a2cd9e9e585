"""Coverage of U of points (``./run bench verify``), and the stations for it.

Cameras and LEDs differ from their files as the files say they may, tip and LEDs are
calibrated by a swing, then points are touched about the cone.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from benchmarks.station import BASELINE, drawn_rig
from tests.simulated_centers import simulate_centers
from tests.simulated_rigs import from_first, row_of_cameras

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import calibrate_rig
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.observation_files import Centers
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of
from lightpen_extensions.measure.tasks.probed_point import (
    SEATING,
    ProbingFrame,
    StillFrames,
    measure_touches,
)
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
    perturbed_pen,
    seen_from,
    swing_poses,
)

N_IMAGES, N_FRAMES = 60, 5
SIGMA = 0.03  # px
LED_SIGMA = 0.002  # mm
ABOUT = 60.0  # mm from the cone, in each direction
CHI_SQUARE_95 = 7.815  # 3 degrees of freedom


def covered_share(n_calibrations: int, n_touches: int, seed: int) -> float:
    """Return the share of touches whose 95 % ellipsoid holds the true point."""
    rng = np.random.default_rng(seed)
    inside = []
    for _ in range(n_calibrations):
        station = calibrated_station(rng)
        instrument = station.instrument
        places = PAPER_CONE + rng.uniform(-ABOUT, ABOUT, (n_touches, 3))
        for place, still in zip(places, station.touched(places, rng), strict=True):
            (touch,) = measure_touches(instrument, [still])
            error = touch.point_cam - place
            covariance = touch.covariance(instrument)
            distance = float(error @ np.linalg.solve(covariance, error))
            inside.append(distance < CHI_SQUARE_95)
    return float(np.mean(inside))


@dataclass(frozen=True, eq=False)
class Station:
    """The true cameras and pen, and what a swing made of their files.

    Attributes
    ----------
    rotation, translation : (3, 3) and (3,) array
        Of the first camera from where a single one stands.
    """

    rig: Rig
    pen: Pen
    instrument: Instrument
    rotation: FloatArray
    translation: FloatArray

    def placed(self, points: FloatArray) -> FloatArray:
        """Return points (N, 3) before a single camera, in the frame of the first."""
        return np.asarray(points @ self.rotation.T + self.translation)

    def touched(
        self, places: FloatArray, rng: np.random.Generator
    ) -> list[StillFrames]:
        """Return images of a pen held still with its tip on places (N, 3).

        As a touch is modelled, the tip comes to rest a little off its place.
        """
        places = places + SEATING * rng.standard_normal(places.shape)
        swing = swing_poses(len(places), rng, pen=self.pen, camera=paper_camera())
        R = np.repeat(self.rotation @ swing.rotations, N_FRAMES, axis=0)
        t = np.repeat(places, N_FRAMES, axis=0) - R @ PAPER_TIP
        images = _seen(self.rig, self.pen, R, t, rng)
        frames = [
            ProbingFrame(str(i), *each)
            for i, each in enumerate(zip(images, R, t, strict=True))
        ]
        return [
            StillFrames(tuple(frames[i : i + N_FRAMES]))
            for i in range(0, len(frames), N_FRAMES)
        ]


def calibrated_station(rng: np.random.Generator, n_cameras: int = 1) -> Station:
    """Return a station with a tip that was calibrated there."""
    pen_file = replace(paper_pen(), led_sigma=LED_SIGMA)
    file, turn, shift = rig_of(paper_camera()), np.eye(3), np.zeros(3)
    if n_cameras > 1:
        row = row_of_cameras(n_cameras, BASELINE)
        file, turn, shift = from_first(row), row.rotations[0], row.translations[0]
    rig, pen = drawn_rig(file, rng), _true_pen(pen_file, rng)
    swing = seen_from(swing_poses(N_IMAGES, rng, pen=pen), turn, shift)
    pixels = _seen(rig, pen, swing.rotations, swing.translations, rng)
    numbers, where = np.arange(1, N_IMAGES + 1), Path("simulated.csv")
    seen = [
        observe_centers(Centers(numbers, pixels[:, c], where), camera, pen_file)
        for c, camera in enumerate(file.cameras)
    ]
    instrument = calibrate_rig(file, pen_file, seen).instrument
    return Station(rig, pen, instrument, turn, shift)


def _seen(
    rig: Rig, pen: Pen, R: FloatArray, t: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Return LED centres (N, C, L, 2) of poses in the rig, px."""
    views = [
        simulate_centers(camera, pen, turn @ R, t @ turn.T + shift, SIGMA, rng)
        for camera, turn, shift in zip(
            rig.cameras, rig.rotations, rig.translations, strict=True
        )
    ]
    return np.stack(views, axis=1)


def _true_pen(file: Pen, rng: np.random.Generator) -> Pen:
    pen = perturbed_pen(file, LED_SIGMA, rng)
    middle = pen.leds.mean(axis=0)
    scale = 1 + (file.scale_sigma or 0.0) * rng.standard_normal()
    diameter = file.diameter + (file.diameter_sigma or 0.0) * rng.standard_normal()
    return replace(pen, leds=middle + scale * (pen.leds - middle), diameter=diameter)
