"""Sessions of a simulated station, as tests and benchmarks of verifications need them.

Camera and LEDs differ from their files as the files say they may. The tip is calibrated
by a swing; then it may be exchanged for another one, and points are probed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from msgspec import structs
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.observation_files import Centers
from lightpen.formats.opened_files import InputFile, Inputs
from lightpen.formats.own_json import record_bytes
from lightpen.model.artefacts import Artefact, ArtefactKind
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen_extensions.measure.tasks.drift import measure_drift
from lightpen_extensions.measure.tasks.fixed_point import (
    FIXED_POINT,
    measure_fixed_point,
)
from lightpen_extensions.measure.tasks.probed_point import (
    ProbedPoint,
    ProbingFrame,
    StillFrames,
    measure_touches,
)
from lightpen_extensions.measure.tasks.registry import measure_artefacts
from lightpen_extensions.measure.tasks.task import (
    Conditions,
    Found,
    VerificationChoices,
)
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    Postures,
    paper_camera,
    paper_pen,
    perturbed_pen,
    swing_poses,
)

LED_SIGMA = SEAT_SIGMA = 0.002  # mm
SIGMA = 0.03  # px
N_IMAGES, N_FRAMES = 60, 5
RING = Artefact(ArtefactKind.RING, 31.751)
LENGTH = Artefact(ArtefactKind.LENGTH, 150.0)
SPHERE = Artefact(ArtefactKind.SPHERE, 30.0)
PLATE = Artefact(ArtefactKind.PLATE, 0.0)
LEAN = 0.4  # rad, of a pen that is not held upright
ENDS = np.array([[-75.0, -20.0, 0.0], [75.0, -20.0, 0.0]])  # from the cone, mm
TABLE = np.array([0.0, -40.0, 0.0])  # likewise
TABLE_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.9, -(0.19**0.5)]])
UNSTEADY = np.radians(3.0)  # of a hand that holds the pen as asked


@dataclass(frozen=True, eq=False)
class SimulatedStation:
    """A camera and a pen as they are, and the instrument that a calibration left.

    Attributes
    ----------
    tip_pen : (3,) array
        Where the tip is, pen frame, mm.
    """

    camera: Camera
    pen: Pen
    tip_pen: FloatArray
    instrument: Instrument

    def with_tip_moved(self, by: FloatArray) -> "SimulatedStation":
        """Return the station after its tip was moved in the pen, mm."""
        return replace(self, tip_pen=self.tip_pen + by)

    def probe(
        self,
        places: FloatArray,
        postures: Postures,
        rng: np.random.Generator,
        *,
        n_frames: int = N_FRAMES,
        seat: float = SEAT_SIGMA,
    ) -> tuple[ProbedPoint, ...]:
        """Probe places (N, 3), camera frame, mm, in N postures."""
        seats = places + seat * rng.standard_normal(places.shape)
        rotations = postures.rotations
        translations = seats - rotations @ self.tip_pen
        R = np.repeat(rotations, n_frames, axis=0)
        t = np.repeat(translations, n_frames, axis=0)
        images = simulate_centers(self.camera, self.pen, R, t, SIGMA, rng)
        frames = [
            ProbingFrame(str(i), each[None], R[i], t[i])
            for i, each in enumerate(images)
        ]
        held = [
            StillFrames(tuple(frames[i : i + n_frames]))
            for i in range(0, len(frames), n_frames)
        ]
        return measure_touches(self.instrument, held)


def calibrated_station(
    rng: np.random.Generator, n_images: int = N_IMAGES
) -> SimulatedStation:
    """Return a station whose tip was calibrated by a swing."""
    file = replace(paper_pen(), led_sigma=LED_SIGMA)
    camera, pen = true_camera(rng), true_pen(file, rng)
    swing = swing_poses(n_images, rng, pen=pen, camera=camera)
    poses = swing.rotations, swing.translations
    pixels = simulate_centers(camera, pen, *poses, SIGMA, rng)
    centers = Centers(np.arange(1, n_images + 1), pixels, Path("simulated.csv"))
    seen = observe_centers(centers, paper_camera(), file)
    instrument = calibrate(paper_camera(), file, seen).instrument
    return SimulatedStation(camera, pen, PAPER_TIP, instrument)


def true_camera(rng: np.random.Generator) -> Camera:
    """Return the paper's camera as its covariance says that it may be."""
    file = paper_camera()
    assert file.covariance is not None
    shift = rng.multivariate_normal(np.zeros(len(file.covariance)), file.covariance)
    return file.with_intrinsics(file.intrinsics + shift)


def true_pen(file: Pen, rng: np.random.Generator) -> Pen:
    """Return a pen as its file says that it may be."""
    pen = perturbed_pen(file, LED_SIGMA, rng)
    middle = pen.leds.mean(axis=0)
    scale = 1 + (file.scale_sigma or 0.0) * rng.standard_normal()
    diameter = file.diameter + (file.diameter_sigma or 0.0) * rng.standard_normal()
    return replace(pen, leds=middle + scale * (pen.leds - middle), diameter=diameter)


def recorded(found: Calibration, file: Path, created: datetime) -> CalibrationFile:
    """Return a calibration as it is read back from its record."""
    nothing = InputFile(Path("leds.csv"), "0" * 64)
    inputs = Inputs(nothing, nothing, (), None)
    record = calibration_record(found, inputs, SwingLimits())
    file.write_bytes(record_bytes(structs.replace(record, created=created)))
    return read_calibration(file)


def swings_of_pen(
    rng: np.random.Generator, n: int, folder: Path, knock: float
) -> tuple[list[CalibrationFile], CalibrationFile]:
    """Return swings of a healthy pen, and one after an LED moved by ``knock``, mm."""
    file = replace(paper_pen(), led_sigma=LED_SIGMA)
    camera, pen = true_camera(rng), true_pen(file, rng)
    leds = pen.leds.copy()
    leds[rng.integers(len(leds))] += knock * any_direction(rng)
    swings = []
    for number, each in enumerate([*[pen] * n, replace(pen, leds=leds)]):
        swing = swing_poses(N_IMAGES, rng, pen=each, camera=camera)
        seats = SEAT_SIGMA * rng.standard_normal(swing.translations.shape)
        poses = swing.rotations, swing.translations + seats
        pixels = simulate_centers(camera, each, *poses, SIGMA, rng)
        centers = Centers(np.arange(1, N_IMAGES + 1), pixels, Path("simulated.csv"))
        seen = observe_centers(centers, paper_camera(), file)
        found = calibrate(paper_camera(), file, seen)
        created = datetime(2026, 1, 1 + number, tzinfo=UTC)
        swings.append(recorded(found, folder / f"swing {number + 1}.json", created))
    return swings[:n], swings[n]


def held(
    tilts: Sequence[float] | FloatArray,
    directions: Sequence[float] | FloatArray,
    rng: np.random.Generator,
) -> Postures:
    """Return postures, rad, as an unsteady hand holds them."""
    n = len(tilts)
    shake = UNSTEADY * rng.standard_normal((3, n))
    return Postures(np.asarray(tilts) + shake[0], directions + shake[1], shake[2])


def any_direction(rng: np.random.Generator) -> FloatArray:
    """Return a unit vector in any direction."""
    way = rng.standard_normal(3)
    return np.asarray(way / np.linalg.norm(way))


def fixed_point_session(
    station: SimulatedStation,
    rng: np.random.Generator,
    n: int = VerificationChoices.n_cone,
    n_frames: int = VerificationChoices.n_cone_frames,
) -> Found:
    """Verify by a cone, as the program asks for it."""
    choices = VerificationChoices(n_cone=n)
    goals = [FIXED_POINT.hand(choices, 0, step) for step in range(n)]
    postures = held([g.tilt for g in goals], [g.direction for g in goals], rng)
    points = station.probe(
        np.tile(PAPER_CONE, (n, 1)), postures, rng, n_frames=n_frames
    )
    return measure_fixed_point([("", points)], Conditions(station.instrument))


def ring_session(
    station: SimulatedStation,
    rng: np.random.Generator,
    n_runs: int = 3,
    n: int = 20,
    *,
    covered: float = 2 * np.pi,
    n_frames: int = N_FRAMES,
    lean: float = 0.0,
) -> Found:
    """Verify by a ring, the pen upright or leant outwards."""
    runs = []
    for i in range(n_runs):
        closed = covered >= 2 * np.pi
        angles = np.linspace(0, covered, n, endpoint=not closed)
        angles += rng.uniform(0, 2 * np.pi)
        places = _on_table(
            RING.certified * np.column_stack([np.cos(angles), np.sin(angles)])
        )
        ways = angles if lean else np.zeros(n)
        postures = held(np.full(n, lean), ways, rng)
        points = station.probe(places, postures, rng, n_frames=n_frames)
        runs.append((str(i), points))
    return measure_artefacts("", n_runs * [RING], runs, Conditions(station.instrument))


def length_session(station: SimulatedStation, rng: np.random.Generator) -> Found:
    """Verify by a length at seven places, the pen upright."""
    runs = []
    for i in range(7):
        places = PAPER_CONE + ENDS + [0.0, 15.0 * i, 0.0]
        points = station.probe(places, held(np.zeros(2), np.zeros(2), rng), rng)
        runs.append((str(i), points))
    return measure_artefacts("", 7 * [LENGTH], runs, Conditions(station.instrument))


def sphere_session(station: SimulatedStation, rng: np.random.Generator) -> Found:
    """Verify by a sphere, probed all over its upper side with the pen upright."""
    n = 25
    angles, height = 2.4 * np.arange(n), np.linspace(0.3, 1.0, n)
    across = np.sqrt(1 - height**2)
    axes = np.vstack([TABLE_AXES, np.cross(*TABLE_AXES)])
    local = np.column_stack([across * np.cos(angles), across * np.sin(angles), height])
    places = PAPER_CONE + TABLE + SPHERE.certified / 2 * local @ axes
    points = station.probe(places, held(np.zeros(n), np.zeros(n), rng), rng)
    return measure_artefacts(
        "", [SPHERE], [("", points)], Conditions(station.instrument)
    )


def plate_session(station: SimulatedStation, rng: np.random.Generator) -> Found:
    """Verify by a plate, probed on a grid with the pen upright."""
    grid = np.linspace(-60.0, 60.0, 4)
    flat = np.array([(x, y) for x in grid for y in grid])
    postures = held(np.zeros(len(flat)), np.zeros(len(flat)), rng)
    points = station.probe(_on_table(flat), postures, rng)
    return measure_artefacts(
        "", [PLATE], [("", points)], Conditions(station.instrument)
    )


def drift_session(
    station: SimulatedStation, rng: np.random.Generator, move: FloatArray | None = None
) -> Found:
    """Visit a drift reference three times, the cone moved by ``move`` in the end."""
    visits = []
    for i in range(3):
        places = np.tile(PAPER_CONE, (3, 1))
        if move is not None:
            places = places + i / 2 * move
        points = station.probe(places, held(np.zeros(3), np.zeros(3), rng), rng)
        visits.append((str(i), points))
    return measure_drift(visits, Conditions(station.instrument))


def _on_table(flat: FloatArray) -> FloatArray:
    """Return places (N, 2) of a table before the camera in its frame, (N, 3), mm."""
    return np.asarray(PAPER_CONE + TABLE + flat @ TABLE_AXES)


Session: TypeAlias = Callable[[SimulatedStation, np.random.Generator], Found]

SESSIONS: dict[str, Session] = {
    "tip check": fixed_point_session,
    "ring, pen upright": ring_session,
    "ring, pen leant": partial(ring_session, lean=LEAN),
    "ring, 280 degrees, one image a point": partial(
        ring_session, n_runs=1, n=30, covered=np.radians(280), n_frames=1
    ),
    "sphere": sphere_session,
    "length": length_session,
    "plane": plate_session,
    "drift": drift_session,
}
