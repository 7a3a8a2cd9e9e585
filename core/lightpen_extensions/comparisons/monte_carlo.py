"""Monte Carlo evaluation of the tip's uncertainty [1]_, as a check of the budget.

The estimate is taken for the truth. Each trial draws files of camera and pen about it,
with the stated or assumed uncertainties, a seat and a drift as U counts them, centres
that are off in each posture, the areas of the discs, and noise in the images; then it
calibrates with these files alone. The scatter of the tips is their uncertainty,
including all nonlinear effects.

References
----------
.. [1] JCGM 101:2008, "Propagation of distributions using a Monte Carlo method".
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from typing import Protocol, TypeVar

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.observations import Observations
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import EXACT_SIGMA
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.linearised import N_CONE, BundleState
from lightpen.estimation.bundle.priors import Priors, modelled_areas
from lightpen.estimation.bundle.unknowns import NONE
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.uncertainty.budget import (
    POSTURES,
    ContributionName,
    center_errors,
    drift_variance,
    seat_covariance,
)
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.coverage import symmetric_root
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.limits import Assumptions
from lightpen.model.pen import Pen, effective_tip, grown
from lightpen.model.rigid import rig_of

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

T = TypeVar("T")
S = TypeVar("S")
Report = Callable[[float], None]


class Map(Protocol):
    """Does something to all items in worker processes."""

    def __call__(
        self, function: Callable[[S], T], items: Sequence[S], report: Report
    ) -> list[T]:
        """Return the results of the function for all items, in order.

        ``report`` is called with the fraction done; an exception from it ends the
        computation, and pending items are dropped.
        """


@contextmanager
def local_workers(n_workers: int | None = None) -> Iterator[Map]:
    """Open worker processes, by default one a core."""
    context = get_context("spawn")  # a fork would copy threads that hold locks
    with ProcessPoolExecutor(
        n_workers or os.cpu_count() or 1, context, initializer=_use_one_thread
    ) as executor:

        def mapped(
            function: Callable[[S], T], items: Sequence[S], report: Report
        ) -> list[T]:
            futures = [executor.submit(function, item) for item in items]
            try:
                for n_done, _ in enumerate(as_completed(futures), 1):
                    report(n_done / len(futures))
                return [future.result() for future in futures]
            except BaseException:
                for future in futures:
                    future.cancel()
                raise

        yield mapped


def _use_one_thread() -> None:
    """Let each process keep to its core."""
    for name in ONE_THREAD:
        os.environ[name] = "1"


SEED = 0
MIN_TRIALS = 20  # fewer give a standard deviation to worse than a sixth
COVERED = 0.95
BY_CHANCE = 3.0  # standard errors, largest difference of three axes by chance
IMMATERIAL = 10.0  # percent of U: about half a unit of its only significant digit
# Not drawn: other cameras, and of the lens only the errors of the centres.
OF_OTHERS = {ContributionName.EXTRINSICS, ContributionName.LENS}


@dataclass(frozen=True, eq=False)
class Trials:
    """The distributions that all trials draw from."""

    # `camera` and `pen`: the truth, with the uncertainties that their files state.
    camera: Camera
    pen: Pen
    tip_pen: FloatArray
    cone_cam: FloatArray
    rotations: FloatArray  # (N, 3, 3), of cam_from_pen
    seen: BoolArray  # (N, L), LEDs that the images show
    sigma: float  # noise of one image coordinate, px
    led_covariance: FloatArray  # (3 L, 3 L), of all LED coordinates of a file, mm^2
    forms: FloatArray  # (N, m), modes of the seat and of drift
    # (3 m, 3 m), of the moves of the cone in these modes, mm^2.
    move_covariance: FloatArray
    jitter: FloatArray  # (3, 3), covariance of the seat from image to image, mm^2
    edge_widths: FloatArray  # (N,), of the LEDs, px; NaN where no areas are known
    priors: Priors
    assumptions: Assumptions


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """The tip from many trials, compared with the linear budget."""

    errors: FloatArray  # (M, 3), of the tip in each trial that could be solved, mm
    linear: FloatArray  # (3,), standard uncertainty by the budget, mm
    n_failed: int  # trials that gave no tip

    @property
    def deviation(self) -> FloatArray:
        """Root mean square error of each coordinate, (3,), mm."""
        return np.asarray(np.sqrt(np.mean(self.errors**2, axis=0)))

    @property
    def precision(self) -> FloatArray:
        """Standard deviation of ``deviation`` by the number of trials, (3,), mm."""
        return np.asarray(self.deviation / np.sqrt(2 * len(self.errors)))

    @property
    def interval(self) -> FloatArray:
        """Of 95 % of the errors, (2, 3), mm."""
        ends = (1 - COVERED) / 2, (1 + COVERED) / 2
        return np.asarray(np.quantile(self.errors, ends, axis=0))

    @property
    def difference(self) -> FloatArray:
        """Linear less Monte Carlo, in units of the precision, (3,)."""
        return (self.linear - self.deviation) / self.precision

    @property
    def explanation(self) -> Message:
        """Explanation of the largest difference from the linear budget."""
        relative = self.linear / self.deviation - 1
        axis = int(np.argmax(np.abs(relative)))
        percent, name = 100 * abs(float(relative[axis])), "xyz"[axis]
        own = 100 / float(np.sqrt(2 * len(self.errors)))
        if abs(self.difference[axis]) <= BY_CHANCE or percent <= IMMATERIAL:
            return message("monte-carlo.confirms", percent=percent, axis=name, own=own)
        if relative[axis] > 0:
            return message("monte-carlo.less", percent=percent, axis=name, own=own)
        return message("monte-carlo.more", percent=percent, axis=name, own=own)


def trials_of(calibration: Calibration) -> Trials:
    """Return the distributions of the trials of a calibration."""
    instrument, joint = calibration.instrument, calibration.joint
    bundle, pen = calibration.bundle, calibration.instrument.pen
    n_images = len(joint.rotations)
    basis, jitter = bundle.unknowns.basis, bundle.components.jitter
    leds = bundle.budget_components.leds
    led_covariance = max(leds.sigma, pen.led_sigma or 0.0) ** 2 * basis @ basis.T
    if pen.led_covariance is not None and leds is NONE:
        led_covariance = pen.led_covariance
    seat = seat_covariance(bundle)
    n_seat, n_drift = len(seat), bundle.layout.drift.stop - bundle.layout.drift.start
    move_covariance = drift_variance(bundle) * np.eye(n_seat + n_drift)
    move_covariance[:n_seat, :n_seat] = seat
    return Trials(
        camera=instrument.camera,
        pen=pen,
        tip_pen=joint.tip_pen,
        cone_cam=joint.cone_cam,
        rotations=joint.rotations,
        seen=joint.used,
        sigma=bundle.sigma * float(np.sqrt(calibration.budget.correlation_factor)),
        led_covariance=led_covariance,
        forms=bundle.unknowns.forms[:n_images, : len(move_covariance) // N_CONE],
        move_covariance=move_covariance,
        jitter=(
            jitter.expected_sigma**2 * np.eye(N_CONE)
            if jitter.covariance is None
            else jitter.covariance
        ),
        edge_widths=_edge_widths(calibration, n_images),
        priors=calibration.priors,
        assumptions=calibration.assumptions,
    )


def run_monte_carlo(
    calibration: Calibration,
    n_trials: int,
    in_workers: Map,
    report: Callable[[float], None] = lambda fraction: None,
) -> MonteCarlo:
    """Run trials of a calibration in worker processes.

    ``report`` is called with the fraction done, 0 to 1; an exception from it ends the
    trials. Raises `CalibrationError` if most of the trials give no tip.
    """
    if n_trials < MIN_TRIALS:
        raise ValueError(f"`n_trials` must be {MIN_TRIALS} or more, got {n_trials}.")
    trials = trials_of(calibration)
    outcomes = in_workers(partial(run_trial, trials), range(n_trials), report)
    errors = [error for error in outcomes if error is not None]
    drawn = np.diag(center_errors(calibration.bundle, float(calibration.used.sum())))
    if 2 * len(errors) < n_trials:
        raise CalibrationError(
            "monte-carlo.failed", n_failed=n_trials - len(errors), n_trials=n_trials
        )
    return MonteCarlo(
        errors=np.array(errors),
        linear=np.sqrt(
            sum(
                (
                    share.standard_uncertainty**2
                    for share in calibration.budget.shares
                    if share.name not in OF_OTHERS
                ),
                drawn[:3],
            )
        ),
        n_failed=n_trials - len(errors),
    )


def run_trial(trials: Trials, number: int) -> FloatArray | None:
    """Return the error of the tip in one trial, (3,), mm; None if it fails."""
    rng = np.random.default_rng([SEED, number])
    levers = (trials.pen.leds - trials.tip_pen) @ np.swapaxes(trials.rotations, 1, 2)
    moves = _drawn_moves(trials, rng)
    exact = ellipse_centers(
        trials.camera,
        levers + (trials.cone_cam + moves)[:, None],
        trials.pen.normals @ np.swapaxes(trials.rotations, 1, 2),
        trials.pen.diameter / 2,
    )
    errors = trials.sigma * rng.standard_normal(exact.shape) + _biases(trials, rng)
    pixels = np.where(trials.seen[..., None], exact + errors, np.nan)
    areas = _drawn_areas(trials, rng)
    off = _drawn(trials.priors.cameras[0].covariance, rng)
    camera = trials.camera.with_intrinsics(trials.camera.intrinsics + off)
    pen = _drawn_pen(trials, rng)
    try:
        seen = _observed(trials, pixels, areas)
        found = calibrate(camera, pen, seen, trials.assumptions)
    except CalibrationError:
        return None
    truth = trials.tip_pen + effective_tip(trials.rotations, moves)[:3]
    return found.joint.tip_pen - truth


def _edge_widths(calibration: Calibration, n_images: int) -> FloatArray:
    """Return the edge widths of the images that the joint fit holds, px."""
    if calibration.priors.reading is None:
        return np.full(n_images, np.nan)
    return np.full(n_images, np.nanmedian(calibration.observations.edge_widths))


def _drawn_moves(trials: Trials, rng: np.random.Generator) -> FloatArray:
    """Return the offset of the tip in the cone in each image, (N, 3), mm."""
    by_form = _drawn(trials.move_covariance, rng).reshape(-1, N_CONE)
    draws = rng.standard_normal((len(trials.forms), N_CONE))
    shaken = draws @ symmetric_root(trials.jitter)
    return np.asarray(trials.forms @ by_form + shaken)


def _biases(trials: Trials, rng: np.random.Generator) -> FloatArray:
    """Return errors of centres, the same in images of like posture, px."""
    some = np.linspace(0, len(trials.rotations) - 1, POSTURES).round().astype(int)
    alike = np.einsum("nij,mij->nm", trials.rotations, trials.rotations[some])
    n_leds = trials.pen.n_leds
    of_posture = rng.standard_normal((POSTURES, n_leds, 2))
    return np.asarray(trials.priors.center_bias * of_posture[alike.argmax(axis=1)])


def _drawn_areas(trials: Trials, rng: np.random.Generator) -> FloatArray:
    """Return areas of discs with a common error, (N, L), px^2; NaN if unknown."""
    reading = trials.priors.reading
    if reading is None:
        return np.full(trials.seen.shape, np.nan)
    state = BundleState(
        rig_of(trials.camera),
        trials.pen,
        trials.tip_pen,
        trials.cone_cam,
        trials.rotations,
    )
    wider = 1 + reading.sigma / trials.pen.diameter * rng.standard_normal()
    return np.where(trials.seen, wider**2 * modelled_areas(state, 0), np.nan)


def _observed(trials: Trials, pixels: FloatArray, areas: FloatArray) -> Observations:
    n_images = len(pixels)
    shifts = trials.rotations @ trials.tip_pen
    return Observations(
        names=tuple(map(str, range(n_images))),
        pixels=pixels,
        seen_pixels=pixels,
        rotations=trials.rotations,
        translations=trials.cone_cam - shifts,
        areas=areas,
        sigmas=np.where(np.isfinite(pixels[..., 0]), EXACT_SIGMA, np.nan),
        edge_widths=trials.edge_widths,
        lamps=np.zeros((n_images, 0, 2)),
        reasons=(Reason.NONE,) * n_images,
        details=(None,) * n_images,
    )


def _drawn_pen(trials: Trials, rng: np.random.Generator) -> Pen:
    pen, priors = trials.pen, trials.priors
    moves = _drawn(trials.led_covariance, rng)
    scale = float(_drawn(priors.size_covariance, rng)[0])
    leds = grown(pen, scale, trials.tip_pen).leds + moves.reshape(-1, 3)
    if priors.reading is not None:
        leds += priors.reading.shift * rng.standard_normal() * pen.normals
    diameter = pen.diameter + float(_drawn(priors.diameter.covariance, rng)[0])
    return replace(pen, leds=leds, diameter=diameter)


def _drawn(covariance: FloatArray, rng: np.random.Generator) -> FloatArray:
    draws = rng.standard_normal(len(covariance))
    return np.asarray(symmetric_root(covariance) @ draws)
