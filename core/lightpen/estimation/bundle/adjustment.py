"""The whole adjustment: fields of the images, contradicted files, correlated noise.

Where a camera file states no uncertainty, the prior assumed in its place must allow for
a bad file. Where the images do not show the file to be off, its values are better than
an estimate from one swing. So the estimate uses the assumed prior shrunk to the
deviation that the images show (empirical Bayes). Its uncertainty counts what single
numbers of the file may be off all the same, as far as the images leave it open.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.bundle import Bundle, fit_bundle
from lightpen.estimation.bundle.change_point import ChangePoint, find_step
from lightpen.estimation.bundle.consistency_findings import (
    ContradictedInputs,
    Contradiction,
    contradictions_of,
    find_contradicted_inputs,
    find_pen_contradictions,
)
from lightpen.estimation.bundle.image_fields import (
    FieldName,
    image_fields,
    seat_modes_of,
)
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.noise_correlation import (
    Correlation,
    measure_correlation,
)
from lightpen.estimation.bundle.priors import Priors
from lightpen.estimation.variance_components import ALLOWED, CERTAIN, find_component
from lightpen.messages import Message, message
from lightpen.model.coverage import EXACT, chi_square_quantile, inverse
from lightpen.model.rigid import of_camera


@dataclass(frozen=True)
class FoundField:
    """A field that the images show beyond doubt."""

    name: FieldName
    camera: str  # name of the camera of a rig that it shifts most; else empty
    size: float  # root mean square shift of its images, px
    gain: float  # twice the log likelihood ratio to no field

    @property
    def message(self) -> Message:
        """The message to the user: kind and size, and the remedy."""
        finding = {
            FieldName.LENS: message("warning.lens-field", size=self.size),
            FieldName.TILT: message("warning.camera-tilt", size=self.size),
            FieldName.BEND: message("warning.pen-bends", size=self.size),
        }[self.name]
        return of_camera(self.camera, finding) if self.camera else finding


def found_fields(bundle: Bundle) -> tuple[FoundField, ...]:
    """Return the fields that chance makes less than once in a thousand.

    The likeliest first; what a camera file states of its lens is none.
    """
    names, found = bundle.state.rig.names, []
    for field, place, component in zip(
        bundle.unknowns.fields,
        bundle.layout.fields,
        bundle.components.fields,
        strict=True,
    ):
        if not field.is_exact and component.gain > chi_square_quantile(1, CERTAIN):
            shifts = field.columns @ bundle.values[place]
            sizes = [
                float(np.sqrt(np.mean(shifts[:, c][used] ** 2)))
                for c, used in enumerate(np.swapaxes(bundle.used, 0, 1))
            ]
            at = int(np.argmax(sizes))
            camera = "" if field.name is FieldName.BEND or not names else names[at]
            found.append(FoundField(field.name, camera, sizes[at], component.gain))
    return tuple(sorted(found, key=lambda each: -each.gain))


# Noise of each centre by its detector, and of each LED as a variance component.
#
# The standard deviations that the detector states are taken relative to their median,
# to the power of maximum likelihood of the residuals: 0 where these do not follow them.
#
# The logarithms of the LEDs' variances are normal about a common mean. Their spread is
# that beyond what as few residuals scatter by, and each is shrunk to the mean by what
# is known of it. LEDs that are alike are not distinguished.


WORTH_IT = 1.25  # times the noise of another LED; less is not worth a new fit
MIN_FREE = 10.0  # degrees of freedom of an LED that is distinguished
LEAST = 1e-12  # px^2
POWERS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])


def find_center_noise(
    residuals: FloatArray, used: BoolArray, sigmas: FloatArray
) -> FloatArray | None:
    """Return the noise of centres, 1 for a usual one, (N, C, L); None if equal.

    ``sigmas`` (N, C, L) are standard deviations by the detector, px; NaN where not
    seen. The residuals (N, C, L, 2) are in px.
    """
    known = used & np.isfinite(sigmas)
    if not known.any() or sigmas[known].min() == sigmas[known].max():
        return None
    ratios = np.where(np.isfinite(sigmas), sigmas / np.median(sigmas[known]), 1.0)
    squares, logs = np.sum(residuals[known] ** 2, axis=-1), np.log(ratios[known])
    # Minus twice the logarithm of the likelihood, with the likeliest common factor.
    means = [np.mean(squares * np.exp(-2 * power * logs)) for power in POWERS]
    costs = 2 * len(logs) * np.log(np.maximum(means, LEAST)) + 4 * POWERS * logs.sum()
    best = int(np.argmin(costs))
    if costs[0] - costs[best] < chi_square_quantile(1, CERTAIN):
        return None
    return np.asarray(ratios ** POWERS[best])


def find_led_noise(
    residuals: FloatArray, used: BoolArray, sigma: float, weights: FloatArray
) -> FloatArray | None:
    """Return the noise of each LED, 1 for a usual one, (C, L); None if equal.

    Parameters
    ----------
    residuals : (N, C, L, 2) array
        px.
    used : (N, C, L) array of bool
    sigma : float
        Noise of the fit for a weight of 1, px, degrees of freedom counted.
    weights : (C, L) array
        Noise of each LED by which the fit weighed it.
    """
    squares = np.sum(np.where(used[..., None], residuals, 0.0) ** 2, axis=(0, 3))
    counts = 2.0 * used.sum(axis=0)
    weighed = float(np.sum(squares / weights**2))
    freedom = min(weighed / (sigma**2 * counts.sum()), 1.0)
    free = counts * freedom
    known = free >= MIN_FREE
    if known.sum() < 2:
        return None
    logs = np.log(np.maximum(squares[known] / free[known], LEAST))
    by_chance = 2 / free[known]
    mean = np.sum(logs / by_chance) / np.sum(1 / by_chance)
    misfit = float(np.sum((logs - mean) ** 2 / by_chance))
    if misfit < chi_square_quantile(len(logs) - 1, CERTAIN):
        return None
    middle = float(np.median(logs))  # a few noisy LEDs are the usual case
    spread = max(float(np.mean((logs - middle) ** 2 - by_chance)), 0.0)
    noise = np.ones(counts.shape)
    noise[known] = np.exp(0.5 * (logs - middle) * spread / (spread + by_chance))
    return noise if noise.max() > WORTH_IT * noise.min() else None


RELATED = 1.1  # times the variance of independent noise; less is not worth a new fit
MAX_RELEASES = 8  # rounds in which contradicted numbers are sought
NOISE_ROUNDS = 3  # in which noisy LEDs lose their weight
NOISE_SETTLED = 0.15  # of a noise; a weight may be off by that
MOST_SHRUNK = 0.01  # of an assumed standard deviation


@dataclass(frozen=True, eq=False)
class Adjustment:
    """An adjustment of tip, cone and all parameters of the files."""

    bundle: Bundle  # with assumed camera priors shrunk
    priors: Priors  # as stated or assumed, with contradicted numbers released
    contradictions: tuple[Contradiction, ...]
    correlation: Correlation
    step: ChangePoint | None  # between two images; the fit does not contain it


@dataclass(frozen=True, eq=False)
class _ConsistentFit:
    """A fit with contradicted parameters released from their priors."""

    bundle: Bundle
    correlation: Correlation
    priors: Priors
    contradictions: tuple[Contradiction, ...]


def adjust(
    state: BundleState,
    pixels: FloatArray,
    priors: Priors,
    places: FloatArray | None = None,
    shifts: FloatArray | None = None,
    sigmas: FloatArray | None = None,
) -> Adjustment:
    """Run the adjustment; release priors that the images contradict.

    Raises `CalibrationError` if the iteration does not settle.

    Parameters
    ----------
    state : BundleState
        Start, with the parameters of the files.
    pixels : (N, C, L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen.
    places : (6 (C - 1),) array, optional
        Extrinsics at the start less those of the rig file, in the order of
        `Rig.covariance`, rad and mm.
    shifts : (N, k) array, optional
        Shifts of fixed lamps in view, px, along which the cone may drift.
    sigmas : (N, C, L) array, optional
        Standard deviation of each centre by its detector, px.
    """
    modes = seat_modes_of(state.rotations, shifts)
    fields = image_fields(pixels, np.isfinite(pixels[..., 0]), state)
    fit = partial(fit_bundle, pixels, state, modes=modes, places=places, fields=fields)
    inflation = 1.0
    fitted = _fit_consistent(partial(fit, inflation=1.0), pixels, state, priors, sigmas)
    if fitted.correlation.factor > RELATED:
        # Correlated noise contradicts a file by chance more often.
        inflation = fitted.correlation.factor
        again = partial(fit, inflation=inflation)
        fitted = _fit_consistent(again, pixels, state, priors, sigmas)
    bundle, correlation = fitted.bundle, fitted.correlation
    shrunk = shrunk_priors(bundle, fitted.priors)
    if shrunk is not fitted.priors:
        same = bundle.unknowns
        bundle = fit(shrunk, inflation=inflation, noise=same.noise, begin=bundle)
        correlation = measure_correlation(bundle, pixels)
    # Fixed lamps show a motion of the camera, which is then corrected.
    step = find_step(bundle, pixels) if shifts is None else None
    if correlation.components is not None:
        bundle = replace(bundle, budget_components=correlation.components)
    return Adjustment(bundle, fitted.priors, fitted.contradictions, correlation, step)


def _fit_consistent(
    fit: "partial[Bundle]",
    pixels: FloatArray,
    state: BundleState,
    priors: Priors,
    sigmas: FloatArray | None,
) -> _ConsistentFit:
    """Fit again and again, with contradicted numbers released, until none is left."""
    rig = state.rig
    bundle = fit(priors)
    of_centers = None
    if sigmas is not None:
        of_centers = find_center_noise(bundle.residuals, bundle.used, sigmas)
    if of_centers is not None:
        fit = partial(fit, noise=of_centers)
        bundle = fit(priors, begin=bundle)
    fit, bundle = _with_led_noise(fit, bundle, priors, of_centers)
    correlation = measure_correlation(bundle, pixels)
    inputs = ContradictedInputs(priors)
    for _ in range(MAX_RELEASES):
        now = find_contradicted_inputs(rig, bundle, priors, correlation.excess, inputs)
        if now.numbers == inputs.numbers:
            break
        inputs, bundle = now, fit(now.priors, begin=bundle)
        correlation = measure_correlation(bundle, pixels)
    of_files = contradictions_of(rig, bundle, priors, correlation.excess, inputs)
    of_pen, released = find_pen_contradictions(
        state.pen, bundle, inputs.priors, correlation.excess
    )
    if of_pen:
        bundle = fit(released, begin=bundle)
        correlation = measure_correlation(bundle, pixels)
    return _ConsistentFit(bundle, correlation, released, of_files + of_pen)


def _with_led_noise(
    fit: "partial[Bundle]",
    bundle: Bundle,
    priors: Priors,
    of_centers: FloatArray | None,
) -> tuple["partial[Bundle]", Bundle]:
    """Weigh each LED by its noise, where these differ, until it settles.

    ``of_centers`` (N, C, L) is the noise of single centres, if these differ.
    """
    known = np.ones_like(bundle.unknowns.noise) if of_centers is None else of_centers
    weights = np.ones(known.shape[1:])
    for _ in range(NOISE_ROUNDS):
        left = bundle.residuals / known[..., None]
        noise = find_led_noise(left, bundle.used, bundle.sigma, weights)
        if noise is None or np.abs(noise / weights - 1).max() < NOISE_SETTLED:
            break
        weights, fit = noise, partial(fit, noise=known * noise)
        bundle = fit(priors, begin=bundle)
    return fit, bundle


def shrunk_priors(bundle: Bundle, priors: Priors) -> Priors:
    """Return priors with assumed intrinsics shrunk to the observed deviations.

    The standard deviation of the intrinsics in units of the assumed one is found by
    restricted maximum likelihood, equation (5) of method.md. What a file may be off
    beyond it is kept for the uncertainty.
    """
    cameras = list(priors.cameras)
    for c, place in enumerate(bundle.layout.cameras):
        if not cameras[c].assumed:
            continue
        known = inverse(bundle.covariance[place, place])
        own = known - bundle.prior_information[place, place]
        right = known @ bundle.values[place]
        root = np.linalg.cholesky(cameras[c].covariance + EXACT**2 * np.eye(len(own)))
        S, b = root.T @ own @ root, root.T @ right
        found = find_component(S, b)
        ratio = max(found.sigma if found.exceeds(ALLOWED) else 0.0, MOST_SHRUNK)
        if ratio < 1:
            expected = np.diag(_expected_squares(S, b, ratio))
            cameras[c] = replace(
                cameras[c],
                covariance=ratio**2 * cameras[c].covariance,
                beyond=root @ expected @ root.T,
            )
    if all(new is old for new, old in zip(cameras, priors.cameras, strict=True)):
        return priors
    return replace(priors, cameras=tuple(cameras))


def _expected_squares(S: FloatArray, right: FloatArray, ratio: float) -> FloatArray:
    """Return the expected squares of k unknowns beyond a shrunk prior, (k,).

    Each by itself is 0, or as large as was assumed, with even odds before the images;
    ``S`` (k, k) and ``right`` (k,) are these, in units of the assumed deviations.
    """
    shrunk = inverse(np.eye(len(S)) + ratio**2 * S)
    seen, right = np.diag(S @ shrunk), shrunk.T @ right
    left = 1 / (1 + seen)
    means = left * right
    odds = np.sqrt(left) * np.exp(np.minimum(0.5 * means * right, 50.0))
    return np.asarray(odds / (1 + odds) * (left + means**2))
