"""The uncertainty of a tip by Monte Carlo [1]_, to check what is linear in the budget.

The estimate is taken for the truth. Each trial draws files of camera and pen about it,
by what the files state of themselves or what is assumed in its place, and noise in the
images; then it calibrates anew, as a user would who has no more than these files. The
scatter of the tips is their uncertainty, whatever is not linear in between. What no
file states, as the form of ball and cone, is not drawn, nor compared.

References
----------
.. [1] JCGM 101:2008, "Propagation of distributions using a Monte Carlo method".
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.observations import Observations
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.joint import ContactModel
from lightpen.estimation.priors import Priors
from lightpen.estimation.uncertainty import ShareName
from lightpen.estimation.unknowns import led_basis
from lightpen.estimation.workers import Map
from lightpen.model.assumptions import Assumptions
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.sentences import sentence

MIN_TRIALS = 20  # fewer tell a standard deviation to worse than a sixth
COVERED = 0.95
DRAWN = {
    *(ShareName.NOISE, ShareName.LEDS, ShareName.SCALE, ShareName.TEMPERATURE),
    *(ShareName.DIAMETER, ShareName.CAMERA),
}


@dataclass(frozen=True, eq=False)
class Trials:
    """What is drawn from; the same for all trials.

    Attributes
    ----------
    camera, pen : Camera, Pen
        The truth, with what their files state of themselves.
    rotations : (N, 3, 3) array
        Of cam_from_pen.
    seen : (N, L) array of bool
        LEDs that the images show.
    sigma : float
        Noise of one image coordinate, px.
    led_sigma : float
        Of one LED coordinate of a file, mm.
    seed : int
    """

    camera: Camera
    pen: Pen
    tip_pen: FloatArray
    cone_cam: FloatArray
    rotations: FloatArray
    seen: BoolArray
    sigma: float
    led_sigma: float
    priors: Priors
    assumptions: Assumptions
    seed: int


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """A tip by many trials, beside the linear budget.

    Attributes
    ----------
    errors : (M, 3) array
        Of the tip in each trial that could be solved, mm.
    linear : (3,) array
        Standard uncertainty by the shares of the budget that are drawn, mm.
    n_failed : int
        Trials that gave no tip.
    """

    errors: FloatArray
    linear: FloatArray
    n_failed: int

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


def trials_of(calibration: Calibration, seed: int = 0) -> Trials:
    """Return what the trials of a calibration draw from."""
    instrument, joint = calibration.instrument, calibration.joint
    return Trials(
        camera=instrument.camera,
        pen=instrument.pen,
        tip_pen=joint.tip_pen,
        cone_cam=joint.cone_cam,
        rotations=joint.rotations,
        seen=joint.used,
        sigma=joint.sigma * float(np.sqrt(calibration.budget.correlation_factor)),
        led_sigma=max(calibration.led_sigma, instrument.pen.led_sigma or 0.0),
        priors=calibration.priors,
        assumptions=calibration.assumptions,
        seed=seed,
    )


def run_monte_carlo(
    calibration: Calibration,
    n_trials: int,
    in_workers: Map,
    report: Callable[[float], None] = lambda fraction: None,
) -> MonteCarlo:
    """Run trials of a calibration in worker processes.

    Parameters
    ----------
    in_workers : Map
        See `lightpen.estimation.workers`.
    report : callable
        Called with the fraction done, 0 to 1; what it raises ends the trials.

    Raises
    ------
    CalibrationError
        Most of the trials give no tip.
    """
    if n_trials < MIN_TRIALS:
        raise ValueError(f"`n_trials` must be {MIN_TRIALS} or more, got {n_trials}.")
    trials = trials_of(calibration)
    outcomes = in_workers(partial(run_trial, trials), range(n_trials), report)
    errors = [error for error in outcomes if error is not None]
    if 2 * len(errors) < n_trials:
        raise CalibrationError(
            sentence(
                "monte-carlo.failed",
                "{n_failed} of {n_trials} trials gave no tip: the swing is too poor to "
                "be repeated by simulation. Capture more images in other postures.",
                n_failed=n_trials - len(errors),
                n_trials=n_trials,
            )
        )
    return MonteCarlo(
        errors=np.array(errors),
        linear=np.sqrt(
            sum(
                share.standard_uncertainty**2
                for share in calibration.budget.shares
                if share.name in DRAWN
            )
        ),
        n_failed=n_trials - len(errors),
    )


def run_trial(trials: Trials, number: int) -> FloatArray | None:
    """Return the error of the tip in one trial, (3,), mm; None where it has none."""
    rng = np.random.default_rng([trials.seed, number])
    model = ContactModel.of(
        trials.camera, trials.pen, np.zeros((*trials.seen.shape, 2))
    )
    # Residuals of images at 0 are the centres with the sign turned.
    exact = -model.at(trials.rotations, trials.tip_pen, trials.cone_cam).residuals
    noise = trials.sigma * rng.standard_normal(exact.shape)
    pixels = np.where(trials.seen[..., None], exact + noise, np.nan)
    camera, pen = _drawn_camera(trials, rng), _drawn_pen(trials, rng)
    try:
        found = calibrate(camera, pen, _observed(trials, pixels), trials.assumptions)
    except CalibrationError:
        return None
    return found.joint.tip_pen - trials.tip_pen


def _observed(trials: Trials, pixels: FloatArray) -> Observations:
    n_images = len(pixels)
    shifts = trials.rotations @ trials.tip_pen
    return Observations(
        names=tuple(map(str, range(n_images))),
        pixels=pixels,
        seen_pixels=pixels,
        rotations=trials.rotations,
        translations=trials.cone_cam - shifts,
        areas=np.full(pixels.shape[:2], np.nan),
        edge_widths=np.full(n_images, np.nan),
        lamps=np.zeros((n_images, 0, 2)),
        reasons=(Reason.NONE,) * n_images,
        details=(None,) * n_images,
    )


def _drawn_camera(trials: Trials, rng: np.random.Generator) -> Camera:
    camera = trials.camera
    errors = _drawn(trials.priors.cameras[0].covariance, rng)
    fx, fy, cx, cy, *distortion = (camera.intrinsics + errors).tolist()
    return replace(camera, fx=fx, fy=fy, cx=cx, cy=cy, distortion=np.array(distortion))


def _drawn_pen(trials: Trials, rng: np.random.Generator) -> Pen:
    pen, priors = trials.pen, trials.priors
    if pen.led_covariance is None:
        basis = led_basis(pen.leds)
        moves = basis @ (trials.led_sigma * rng.standard_normal(basis.shape[1]))
    else:
        moves = _drawn(pen.led_covariance, rng)
    middle = pen.leds.mean(axis=0)
    scale = 1 + float(_drawn(priors.size_covariance, rng)[0])
    leds = middle + scale * (pen.leds - middle) + moves.reshape(-1, 3)
    diameter = pen.diameter + float(_drawn(priors.diameter.covariance, rng)[0])
    return replace(pen, leds=leds, diameter=diameter)


def _drawn(covariance: FloatArray, rng: np.random.Generator) -> FloatArray:
    values, vectors = np.linalg.eigh(covariance)
    sigmas = np.sqrt(np.maximum(values, 0.0))
    return np.asarray(vectors @ (sigmas * rng.standard_normal(len(sigmas))))
