"""Measured parts (``./run bench measure``): coverage of U, speed, and other fits.

Each part is the simulated plate (holes, cylinder, cone, sphere, line, point), measured
by its plan at a station of its own, see `benchmarks.touches`. The ball comes at an
angle to each surface, as a hand brings it. The true features are those that the
surfaces deviate from by their form; a form error is that of the points.
"""

import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
import pyransac3d
from benchmarks.rows import Row, numbers
from benchmarks.touches import calibrated_station
from benchmarks.workers import Workers
from msgspec import structs
from skspatial.objects import Cylinder, Line, Plane, Sphere

from lightpen.arrays import FloatArray
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.measure.measuring.characteristics import FORMS
from lightpen_extensions.measure.measuring.features import fit_feature, frame_about
from lightpen_extensions.measure.measuring.part import measure_part
from lightpen_extensions.measure.measuring.plan import (
    CharacteristicKind,
    PlannedCharacteristic,
)
from lightpen_extensions.measure.measuring.plan import Plan as MeasuringPlan
from lightpen_extensions.measure.measuring.surfaces import SURFACES, FeatureKind
from lightpen_extensions.measure.probing_operator import plate_plan
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.probed_point import measure_touches
from lightpen_extensions.measure.tasks.task import Conditions, VerificationChoices
from lightpen_extensions.simulator.swings import PAPER_CONE

CAMERAS = 1, 2
N_PARTS, N_CHUNKS = 400, 20
BALL = 10.0  # mm
SHAPE = 0.01  # mm, standard deviation of a part's surface from its features
ASKEW = np.radians(10.0)  # rms angle of an approach to the normal, about each axis
SHARE_LIMITS = 0.93, 0.97
FIXED = 1e-9  # mm, U of what a feature or the alignment fixes
N_TOUCHES, LONGEST, N_TIMED = 50, 0.020, 30  # a feature, s
FORM, N_FITS = 0.01, 20  # mm, of the points that other programs fit, too
N_RANSAC = 1000  # tries; with 10000, a cylinder takes seconds
POINT = "pad"
AWAY = np.array([100.0, -50.0, 1000.0])  # mm
UM = 1000.0
DISTANCE, ANGLE = CharacteristicKind.DISTANCE, CharacteristicKind.ANGLE
MORE = (
    PlannedCharacteristic(DISTANCE, ("dome", "countersink"), nominal=50.0),
    PlannedCharacteristic(DISTANCE, ("dome", "top"), nominal=2.0),
    PlannedCharacteristic(ANGLE, ("top", "front"), nominal=90.0),
    PlannedCharacteristic(CharacteristicKind.STRAIGHTNESS, ("front",)),
    PlannedCharacteristic(CharacteristicKind.ROUNDNESS, ("hole 1",)),
    PlannedCharacteristic(CharacteristicKind.CYLINDRICITY, ("bore",)),
    PlannedCharacteristic(CharacteristicKind.FORM, ("dome",)),
    PlannedCharacteristic(CharacteristicKind.FORM, ("countersink",)),
    PlannedCharacteristic(CharacteristicKind.PARALLELISM, ("front",), datum="top"),
    PlannedCharacteristic(
        CharacteristicKind.CONCENTRICITY, ("countersink",), datum="bore"
    ),
)


@cache
def _plan() -> MeasuringPlan:
    """Return the plan of the plate with more characteristics."""
    plan = plate_plan()
    return structs.replace(plan, characteristics=(*plan.characteristics, *MORE))


@dataclass(frozen=True)
class CoveredPart:
    """A part, and whether U (k = 2) holds the true values.

    Attributes
    ----------
    features : mapping of str to float
        Share of the values of a feature (place, axis, sizes) that U holds.
    holds : mapping of str to bool
        Of each characteristic.
    """

    features: dict[str, float]
    holds: dict[str, bool]


def part_rows(workers: Workers) -> list[Row]:
    """Return how often U of a part holds, how fast and how exact features are."""
    n = N_PARTS // N_CHUNKS
    found = [
        [
            part
            for parts in workers.map(partial(covered_parts, n, c), range(N_CHUNKS))
            for part in parts
        ]
        for c in CAMERAS
    ]
    return [*coverage_rows(found), *feature_rows(workers)]


def coverage_rows(found: Sequence[Sequence[CoveredPart]]) -> list[Row]:
    """Return the coverage of parts with one camera and with two."""
    n = len(found[0])
    low, high = SHARE_LIMITS
    chance = 3 * float(np.sqrt(0.95 * 0.05 / n))  # three standard errors
    bounds = {each.label for each in _plan().characteristics if _is_bound(each)}

    def row(what: str, shares: Sequence[float], *, is_bound: bool = False) -> Row:
        most = 1.0 if is_bound else high
        limit = f"{100 * low:.0f} % at least" if is_bound else "93 to 97 %"
        limit += ", but for chance"
        return Row(
            what,
            f"{numbers((100 * each for each in shares), 1)} %",
            limit,
            met=all(low - chance <= each <= most + chance for each in shares),
        )

    first = f"{n} simulated plates, one and two cameras: U (k = 2) holds the "
    names = [*found[0][0].features]
    shares = [
        [float(np.mean([p.features[f] for p in ps])) for ps in found] for f in names
    ]
    rows = [
        row(f"{first if i == 0 else '- '}feature {name}", share)
        for i, (name, share) in enumerate(zip(names, shares, strict=True))
    ]
    for name in found[0][0].holds:
        share = [float(np.mean([p.holds[name] for p in ps])) for ps in found]
        rows.append(row(f"- {name}", share, is_bound=name in bounds))
    return rows


def _is_bound(planned: PlannedCharacteristic) -> bool:
    return planned.nominal is None  # a geometrical deviation: U is an upper bound


def covered_parts(n_parts: int, n_cameras: int, seed: int) -> list[CoveredPart]:
    """Measure the simulated plate by a tip of its own each time."""
    rng = np.random.default_rng([n_cameras, seed])
    return [_covered_part(n_cameras, rng) for _ in range(n_parts)]


@cache
def _probed() -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Return features, ball centres and approaches, before a single camera."""
    names, places, approaches = [], [], []
    for run, planned in enumerate(_plan().features):
        for step in range(planned.n_touches):
            goal = PART.hand(VerificationChoices(plan=_plan()), run, step)
            assert goal.point is not None
            assert goal.outwards is not None
            names.append(planned.name)
            places.append(PAPER_CONE + goal.point + BALL / 2 * goal.outwards)
            approaches.append(-goal.outwards)
    return tuple(names), np.array(places), np.array(approaches)


def _covered_part(n_cameras: int, rng: np.random.Generator) -> CoveredPart:
    station = calibrated_station(rng, n_cameras)
    names, places, approaches = _probed()
    of_form = SHAPE * rng.standard_normal((len(places), 1))
    of_form[[name == POINT for name in names]] = 0.0  # which is where it is touched
    ideal = station.placed(places)
    places = station.placed(places + of_form * approaches)
    approaches = approaches + np.tan(ASKEW) * rng.standard_normal(approaches.shape)
    approaches /= np.linalg.norm(approaches, axis=1)[:, None]
    held = station.touched(places, rng)
    points = [
        replace(point, approach_cam=station.rotation @ way)
        for point, way in zip(
            measure_touches(station.instrument, held), approaches, strict=True
        )
    ]
    runs = [(name, [point]) for name, point in zip(names, points, strict=True)]
    conditions = Conditions(station.instrument, ball_diameter=BALL, ball_uncertainty=0)
    choices = VerificationChoices(PART.kind, _plan())
    part = PART.measure(runs, conditions, choices).part
    exact = measure_part(_plan(), replace(part.touches, points_cam=ideal))
    sampled = measure_part(_plan(), replace(part.touches, points_cam=places))
    features, holds = {}, {}
    for name, one in part.features.items():
        u = part.uncertainty(name)
        is_known = np.abs(one.in_part.values - exact.features[name].in_part.values) <= u
        features[name] = float(np.mean(is_known[u > FIXED]))
    for result, true, form in zip(
        part.results, exact.results, sampled.results, strict=True
    ):
        label = result.planned.label
        if result.planned.quantity in FORMS:
            true = form
        error = result.value.value - true.value.value
        holds[label] = abs(error) <= result.value.uncertainty
    return CoveredPart(features, holds)


# Speed, and other programs


def feature_rows(workers: Workers) -> list[Row]:
    """Return how long a feature takes, and how exact it is beside other programs."""
    seconds = workers.call(_slowest)
    others = {name: workers.call(partial(_errors, name)) for name in ("ours", *PEERS)}
    rows = [
        Row(
            f"a feature of {N_TOUCHES} touches with U: processor time of the slowest "
            f"kind, {seconds[0]}",
            f"{1000 * seconds[1]:.1f} ms",
            f"{1000 * LONGEST:.0f} ms",
            met=seconds[1] <= LONGEST,
        )
    ]
    for kind, own in others["ours"].items():
        theirs = [
            f"{name} {UM * others[name][kind]:.1f} µm"
            for name in PEERS
            if kind in others[name]
        ]
        rows.append(
            Row(
                f"{kind.value} of {N_TOUCHES} touches, {UM * FORM:.0f} µm of noise: "
                "rms distance of its true points",
                f"{UM * own:.1f} µm",
                others=", ".join(theirs),
            )
        )
    return rows


def _shape(kind: FeatureKind, rng: np.random.Generator) -> FloatArray:
    """Return points (N, 3) of a feature about the z axis of its frame, on one side."""
    n = N_TOUCHES
    turn, z = rng.uniform(0, np.radians(200), n), rng.uniform(-20, 20, n)
    round_ = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    height = np.column_stack([np.zeros((n, 2)), z])
    match kind:
        case FeatureKind.LINE:
            return height
        case FeatureKind.PLANE:
            return np.column_stack([rng.uniform(-40, 40, (n, 2)), np.zeros(n)])
        case FeatureKind.CIRCLE:
            return np.asarray(15 * round_)
        case FeatureKind.SPHERE:
            rise = rng.uniform(0, 1, n)[:, None]
            up = np.array([0.0, 0.0, 15.0])
            return np.asarray(15 * np.sqrt(1 - rise**2) * round_ + rise * up)
        case FeatureKind.CONE:
            return np.asarray((15 + z[:, None] * np.tan(0.4)) * round_ + height)
        case _:
            return 15 * round_ + height


def _slowest() -> tuple[str, float]:
    """Return the kind that takes longest with its covariance, and processor time, s."""
    rng, found = np.random.default_rng(1), {}
    covariance = FORM**2 * np.eye(3 * N_TOUCHES)
    for kind in set(FeatureKind) - {FeatureKind.POINT}:
        points = _shape(kind, rng) + FORM * rng.standard_normal((N_TOUCHES, 3))
        times = []
        for _ in range(N_TIMED):
            start = time.process_time()
            fit = fit_feature(kind, points + AWAY)
            np.sqrt(np.diag(fit.by_points @ covariance @ fit.by_points.T))
            times.append(time.process_time() - start)
        found[kind.value] = min(times)
    return max(found.items(), key=lambda item: item[1])


Fitted = tuple[FloatArray, FloatArray, FloatArray]
"""Origin, axis and sizes as `features.Feature` has them."""


def _ours(kind: FeatureKind, points: FloatArray) -> Fitted:
    fit = fit_feature(kind, points)
    return fit.origin, fit.axis, fit.sizes


def _scikit_spatial(kind: FeatureKind, points: FloatArray) -> Fitted:
    z = np.array([0.0, 0.0, 1.0])
    match kind:
        case FeatureKind.LINE:
            line = Line.best_fit(points)
            assert isinstance(line, Line)
            return np.array(line.point), np.array(line.direction), np.zeros(0)
        case FeatureKind.PLANE:
            plane = Plane.best_fit(points)
            assert isinstance(plane, Plane)
            return np.array(plane.point), np.array(plane.normal), np.zeros(0)
        case FeatureKind.SPHERE:
            ball = Sphere.best_fit(points)
            return np.array(ball.point), z, np.array([ball.radius])
        case _:
            bore = Cylinder.best_fit(points)
            middle = np.array(bore.point) + np.array(bore.vector) / 2
            return middle, np.array(bore.vector), np.array([bore.radius])


def _pyransac(kind: FeatureKind, points: FloatArray) -> Fitted:
    z, limit = np.array([0.0, 0.0, 1.0]), 3 * FORM
    match kind:
        case FeatureKind.LINE:
            way, origin, _ = pyransac3d.Line().fit(points, limit, N_RANSAC)
            return np.array(origin), np.array(way), np.zeros(0)
        case FeatureKind.PLANE:
            (a, b, c, d), _ = pyransac3d.Plane().fit(points, limit, N_RANSAC)
            normal = np.array([a, b, c])
            return -d * normal / (normal @ normal), normal, np.zeros(0)
        case FeatureKind.CIRCLE:
            origin, way, radius, _ = pyransac3d.Circle().fit(points, limit, N_RANSAC)
            return np.array(origin), np.array(way), np.array([radius])
        case FeatureKind.SPHERE:
            origin, radius, _ = pyransac3d.Sphere().fit(points, limit, N_RANSAC)
            return np.array(origin), z, np.array([radius])
        case _:
            origin, way, radius, _ = pyransac3d.Cylinder().fit(points, limit, N_RANSAC)
            return np.array(origin), np.array(way), np.array([radius])


SIMPLE = FeatureKind.LINE, FeatureKind.PLANE, FeatureKind.SPHERE, FeatureKind.CYLINDER
PEERS = {"scikit-spatial": SIMPLE, "pyransac3d": (*SIMPLE, FeatureKind.CIRCLE)}
FITS: dict[str, Callable[[FeatureKind, FloatArray], Fitted]] = {
    "ours": _ours,
    "scikit-spatial": _scikit_spatial,
    "pyransac3d": _pyransac,
}


def _errors(program: str) -> dict[FeatureKind, float]:
    """Return the rms distance of true points from the features of a program, mm."""
    found = {}
    for kind in PEERS.get(program, (*SIMPLE, FeatureKind.CIRCLE)):
        rng, squares = np.random.default_rng(2), []
        random.seed(2)
        for _ in range(N_FITS):
            R = rotation_from_vector(rng.normal(size=3))
            true = _shape(kind, rng) @ R.T + AWAY
            noisy = true + FORM * rng.standard_normal(true.shape)
            origin, axis, sizes = FITS[program](kind, noisy)
            q = (true - origin) @ frame_about(axis)
            distances = SURFACES[kind].distances(q, sizes).values
            squares.append(np.mean(np.sum(distances**2, axis=1)))
        found[kind] = float(np.sqrt(np.mean(squares)))
    return found
