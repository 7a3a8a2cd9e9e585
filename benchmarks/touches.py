"""Coverage of U: of points (``./run bench verify``) and of parts (``measure``).

Camera and LEDs differ from their files as the files say they may, tip and LEDs are
calibrated by a swing, then points are touched about the cone, or the features of the
simulated plate by its plan.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.observation_files import Centers
from lightpen.measuring.plan import CharacteristicKind
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.simulator.plate import plate_plan
from lightpen.simulator.swings import (
    PAPER_CONE,
    paper_camera,
    paper_pen,
    perturbed_pen,
    simulate_centers,
    swing_poses,
)
from lightpen.verification.tasks.part import PART, PartOptions
from lightpen.verification.tasks.probed_point import (
    ProbingFrame,
    StillFrames,
    measure_touches,
)
from lightpen.verification.tasks.task import Conditions

N_IMAGES, N_FRAMES = 60, 5
SIGMA = 0.03  # px
LED_SIGMA = 0.002  # mm
BALL = 10.0  # mm
ABOUT = 60.0  # mm from the cone, in each direction
CHI_SQUARE_95 = 7.815  # 3 degrees of freedom


def covered_share(n_calibrations: int, n_touches: int, seed: int) -> float:
    """Return the share of touches whose 95 % ellipsoid holds the true point."""
    rng = np.random.default_rng(seed)
    inside = []
    for _ in range(n_calibrations):
        station = _calibrated(rng)
        instrument = station.instrument
        for _ in range(n_touches):
            place = PAPER_CONE + rng.uniform(-ABOUT, ABOUT, 3)
            (touch,) = measure_touches(instrument, [station.touched(place, rng)])
            error = touch.point_cam - place
            covariance = touch.covariance(instrument)
            distance = float(error @ np.linalg.solve(covariance, error))
            inside.append(distance < CHI_SQUARE_95)
    return float(np.mean(inside))


@dataclass(frozen=True)
class CoveredPart:
    """What U (k = 2) of each characteristic of a plate holds, and how large it is.

    Attributes
    ----------
    holds : mapping of str to bool
        Whether U holds the true value.
    ratio : float
        Mean of U of distances by U of independent points.
    """

    holds: dict[str, bool]
    ratio: float


def covered_parts(n_parts: int, seed: int) -> list[CoveredPart]:
    """Measure the simulated plate by a tip of its own each time."""
    rng = np.random.default_rng(seed)
    return [_covered_part(rng) for _ in range(n_parts)]


def _covered_part(rng: np.random.Generator) -> CoveredPart:
    station, options = _calibrated(rng), PartOptions(plate_plan())
    instrument = station.instrument
    held, names = [], []
    for run, planned in enumerate(plate_plan().features):
        for step in range(planned.n_touches):
            goal = PART.hand(options, run, step)
            assert goal.point is not None
            assert goal.outwards is not None
            place = PAPER_CONE + goal.point + BALL / 2 * goal.outwards
            held.append(station.touched(place, rng))
            names.append(planned.name)
    points = measure_touches(instrument, held)
    runs = [
        (
            each.name,
            [p for p, name in zip(points, names, strict=True) if name == each.name],
        )
        for each in plate_plan().features
    ]
    found = PART.measure(
        runs, Conditions(instrument, ball_diameter=BALL), PartOptions(plate_plan(), 0.0)
    )
    holds, ratios = {}, []
    for result in found.part.results:
        if result.quantity is None or result.independent_uncertainty is None:
            continue  # of a geometrical deviation U is an upper bound
        error = result.value.value - (result.planned.nominal or 0.0)
        holds[result.planned.label] = abs(error) <= result.value.uncertainty
        if result.planned.quantity is CharacteristicKind.DISTANCE:
            ratios.append(result.value.uncertainty / result.independent_uncertainty)
    return CoveredPart(holds, float(np.mean(ratios)))


@dataclass(frozen=True, eq=False)
class _Station:
    """The true camera and pen, and what a swing made of their files."""

    camera: Camera
    pen: Pen
    instrument: Instrument

    def touched(self, place: FloatArray, rng: np.random.Generator) -> StillFrames:
        """Return images of a pen that is held still with its tip on a place."""
        held = swing_poses(1, rng, pen=self.pen, camera=self.camera, cone_cam=place)
        R = np.repeat(held.rotations, N_FRAMES, axis=0)
        t = np.repeat(held.translations, N_FRAMES, axis=0)
        images = simulate_centers(self.camera, self.pen, R, t, SIGMA, rng)
        return StillFrames(
            tuple(
                ProbingFrame(str(i), each[None], R[i], t[i])
                for i, each in enumerate(images)
            )
        )


def _calibrated(rng: np.random.Generator) -> _Station:
    file = replace(paper_pen(), led_sigma=LED_SIGMA)
    camera, pen = _true_camera(rng), _true_pen(file, rng)
    swing = swing_poses(N_IMAGES, rng, pen=pen, camera=camera)
    pixels = simulate_centers(
        camera, pen, swing.rotations, swing.translations, SIGMA, rng
    )
    centers = Centers(np.arange(1, N_IMAGES + 1), pixels, Path("simulated.csv"))
    seen = observe_centers(centers, paper_camera(), file)
    return _Station(camera, pen, calibrate(paper_camera(), file, seen).instrument)


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
