"""Bundle adjustment with priors: the tip, and whatever else the images depend on.

Beside tip, cone and rotations the fit holds the intrinsics of each camera, its place
in the rig, the LEDs, the pen's scale and the diameter of its discs, each with a
prior: what its file says, with the uncertainty that the file states or that is
assumed in its place. So the images put right what the files have wrong as far as they
can, and the covariance holds what they cannot. Errors of the LEDs, of the seat as it
follows the pen's lean and of a drift have a standard deviation that the images
themselves tell (`lightpen.estimation.variance_components`).

The rotations are eliminated image by image [1]_; a change of priors costs no new look
at the images then. The tip is given in the frame in which the file's LEDs fit the
true ones best: moves of the pen as a whole are no errors of its LEDs.

References
----------
.. [1] B. Triggs et al., "Bundle adjustment - a modern synthesis", LNCS 1883 (2000)
   298-372, section 6.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.pose import NOISE_FLOOR, robust_sigma
from lightpen.errors import CalibrationError
from lightpen.estimation.component_search import find_components
from lightpen.estimation.components import NO_COMPONENTS, Components
from lightpen.estimation.information import inverse
from lightpen.estimation.joint import gate
from lightpen.estimation.linearised import (
    N_CONE,
    N_TURN,
    BundleState,
    CameraView,
    Eliminated,
    NormalEquations,
    eliminate,
    views_at,
)
from lightpen.estimation.priors import Priors
from lightpen.estimation.seat_forms import Forms
from lightpen.estimation.unknowns import Columns, Unknowns
from lightpen.estimation.variance_components import Jitter, find_jitter
from lightpen.sentences import sentence

CONVERGED = 1e-5  # mm
FINEST = 1e-4  # px; exact data that weigh more drown the priors in rounding
FINDING_PASSES = 4  # in which standard deviations are found; then they stand
MAX_PASSES = 20
Z_99 = 2.326  # normal quantile


@dataclass(frozen=True, eq=False)
class Bundle:
    """Everything that the images of a swing were fitted by.

    Attributes
    ----------
    state : BundleState
        With the cameras and the pen as the images and the files together have them.
    values : (p,) array
        Deviations from the files; tip and cone are 0.
    components : Components
        By which LEDs, seat and drift were fitted.
    counted : Components
        The same as U holds them: without what noise that lasts explains.
    residuals : (N, C, L, 2) array
        Observed minus modelled centres, px, the seat included; NaN where not seen.
    used : (N, C, L) array of bool
    sigma : float
        Noise of one image coordinate, px.
    information : (p, p) array
        Of the images, rotations eliminated.
    prior_information : (p, p) array
    measured_information : (p, p) array
        Of what was measured beside the centres: areas, the distance of two cones.
    jitter_information : (p, p) array
        How much of ``information`` the jitter of the seat makes uncertain.
    doubted_jitter : (p, p) array
        Covariance of the right side by what jitter is to be expected where it is not
        significant.
    weight_sigma : float
        By which LEDs were weighed, px: ``sigma``, and more where it hangs together.
    covariance : (p, p) array
        Inverse of the three together, images taken as independent.
    """

    unknowns: Unknowns
    state: BundleState
    values: FloatArray
    components: Components
    counted: Components
    residuals: FloatArray
    used: BoolArray
    sigma: float
    information: FloatArray
    prior_information: FloatArray
    measured_information: FloatArray
    jitter_information: FloatArray
    doubted_jitter: FloatArray
    weight_sigma: float
    covariance: FloatArray

    @cached_property
    def counted_prior(self) -> FloatArray:
        """What is known before the images as U holds it, (p, p)."""
        if self.counted is self.components:
            return self.prior_information
        return self.unknowns.prior_information(self.counted)

    @property
    def columns(self) -> Columns:
        """Those of ``values`` and of every matrix."""
        return self.unknowns.columns

    @property
    def led_corrections(self) -> FloatArray:
        """What the LEDs of the file are off by, beside the scale, (L, 3), mm."""
        moves = self.unknowns.basis @ self.values[self.columns.leds]
        return np.asarray(moves.reshape(-1, 3))

    @property
    def drift(self) -> float:
        """How far apart the farthest two places of the cone are by its drift, mm."""
        at, unknowns = self.columns, self.unknowns
        first = (at.drift.start - at.seat[0].start) // N_CONE
        n_forms = (at.drift.stop - at.drift.start) // N_CONE
        by_form = self.values[at.drift].reshape(-1, N_CONE)
        places = unknowns.forms[:, first : first + n_forms] @ by_form
        apart = np.linalg.norm(places[:, None] - places, axis=2)
        return float(apart.max())

    @property
    def cone_moves(self) -> FloatArray:
        """What the cone of each image moved by, as fitted, (N, 3), mm.

        As the pen leant and in the course of the swing.
        """
        at = self.columns
        by_form = self.values[at.seat[0].start : at.drift.stop].reshape(-1, N_CONE)
        return np.asarray(self.unknowns.forms[:, : len(by_form)] @ by_form)

    def part(self, *kinds: slice) -> FloatArray:
        """Return what stands in tip and cone for some unknowns, (6, 6).

        By errors of their priors, and of what was measured of them.
        """
        known = self.prior_information + self.measured_information
        own = np.zeros_like(self.covariance)
        for at in kinds:
            own[at, at] = known[at, at]
        return self.carried(own)

    def counted_part(self, at: slice) -> FloatArray:
        """Return what stands in tip and cone for LEDs or a drift, as counted, (6, 6).

        They were fitted as if they were as large as the components have it.
        """
        gain = self.covariance[:6, at] @ self.prior_information[at, at]
        return np.asarray(gain @ inverse(self.counted_prior[at, at]) @ gain.T)

    def carried(self, information: FloatArray) -> FloatArray:
        """Return the covariance of tip and cone by errors of that information, (6, 6).

        The information (p, p) is a part of that of images and priors together.
        """
        both = self.covariance[:6]
        return np.asarray(both @ information @ both.T)

    @property
    def independent_noise(self) -> FloatArray:
        """Covariance of tip and cone from noise, independent between images, (6, 6)."""
        noise = self.carried(self.information - self.jitter_information)
        return noise * (self.sigma / self.weight_sigma) ** 2


def fit_bundle(
    pixels: FloatArray,
    start: BundleState,
    priors: Priors,
    forms: Forms,
    inflation: float = 1.0,
    places: FloatArray | None = None,
) -> Bundle:
    """Fit tip, cone and all that the files may have wrong to the LED centres.

    Parameters
    ----------
    pixels : (N, C, L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen.
    start : BundleState
        With cameras and pen as their files have them.
    forms : Forms
        In which the seat may follow the pen's lean, and the cone drift.
    inflation : float
        How many times the variance of the noise counts beside the priors, as it does
        not average out.
    places : (6 (C - 1),) array, optional
        Off the file of the rig, from where the cameras' places begin; 0 unless given.

    Raises
    ------
    CalibrationError
        The iteration does not settle.
    """
    unknowns = Unknowns.of(start, priors, forms)
    at = unknowns.columns
    state, taken_up = start, np.zeros(unknowns.number)
    if places is not None:
        taken_up[at.extrinsics] = places
        state = unknowns.moved(start, taken_up, np.zeros((len(pixels), N_TURN)))
    views = views_at(state, pixels)
    residuals = _stacked(views)
    used = gate(_together(residuals)).reshape(residuals.shape[:-1])
    sigma = robust_sigma(_together(residuals), N_TURN)
    components = NO_COMPONENTS
    for n_pass in range(MAX_PASSES):
        weight_sigma = max(sigma * float(np.sqrt(inflation)), FINEST)
        eliminated = eliminate(views, used, weight_sigma, components.jitter.covariance)
        information, gradient = unknowns.system(eliminated)
        measured, measured_right = unknowns.measured(state, taken_up)
        right = gradient + information @ taken_up + measured_right
        finding = 0 < n_pass <= FINDING_PASSES
        # The jitter first: without it, what other errors there are take it up.
        if finding and n_pass > 1:
            components = find_components(
                unknowns, information + measured, right, components
            )
        prior = unknowns.prior_information(components)
        covariance = inverse(information + prior + measured)
        values = covariance @ right
        step, shifts = unknowns.step(values - taken_up)
        unknown = _follow(eliminated, step, shifts)
        residuals = _left_over(views, step, shifts, unknown)
        n_fitted = float(np.sum(covariance * information)) + _n_eliminated(
            eliminated, components.jitter.covariance, used
        )
        squares = np.where(used[..., None], residuals, 0.0) ** 2
        n_free = max(2 * int(used.sum()) - n_fitted, 1.0)
        sigma = max(float(np.sqrt(squares.sum() / n_free)), NOISE_FLOOR)
        if finding:
            alone = (
                eliminated
                if components.jitter.covariance is None
                else eliminate(views, used, weight_sigma)
            )
            seen = np.asarray(used.any(axis=(1, 2)))
            spread = unknowns.sensitivity(alone.cone_rows)
            change = values - taken_up
            jitter = jitter_of(unknowns, alone, spread, seen, change, covariance)
            components = components._replace(jitter=jitter)
            used = gate(_together(residuals)).reshape(used.shape)
        moved = np.abs((values - taken_up)[:6]).max()
        state = unknowns.moved(state, values, unknown[:, :N_TURN])
        taken_up = values.copy()
        for kind in (at.tip, at.cone, *at.seat, at.drift):  # the state has no place for
            taken_up[kind] = 0.0
        views = views_at(state, pixels)
        if n_pass > FINDING_PASSES and moved < CONVERGED:
            jitter = components.jitter
            doubted = jitter_information = np.zeros_like(information)
            if jitter.covariance is None:
                seat = unknowns.sensitivity(eliminated.cone_rows)
                rows = jitter.expected * seat.reshape(-1, seat.shape[-1])
                doubted = rows.T @ rows
            else:
                seat = unknowns.sensitivity(eliminated.turn_by_step[:, N_TURN:])
                jitter_information = np.einsum(
                    "nip,ij,njq->pq",
                    *(seat, np.linalg.inv(jitter.covariance), seat),
                    optimize=True,
                )
            return Bundle(
                unknowns=unknowns,
                state=state,
                values=values,
                components=components,
                counted=components,
                residuals=residuals,
                used=used,
                sigma=sigma,
                information=information,
                prior_information=prior,
                measured_information=measured,
                jitter_information=jitter_information,
                doubted_jitter=doubted,
                weight_sigma=weight_sigma,
                covariance=covariance,
            )
    raise CalibrationError(
        sentence(
            "bundle.not-settled",
            "The joint fit did not settle in {n_steps} steps. The images may not be "
            "of this pen and camera: check both files.",
            n_steps=MAX_PASSES,
        )
    )


def _stacked(views: tuple[CameraView, ...]) -> FloatArray:
    return np.stack([view.residuals for view in views], axis=1)


def _together(residuals: FloatArray) -> FloatArray:
    """Return residuals (N, C, L, 2) with the LEDs of all cameras in one row."""
    return residuals.reshape(len(residuals), -1, 2)


def _follow(each: Eliminated, step: FloatArray, shifts: FloatArray) -> FloatArray:
    """Return the step of each image's own unknowns, (N, q)."""
    by_cone = each.turn_by_step[..., :N_CONE]
    return np.asarray(
        each.turn + each.turn_by_step @ step + np.einsum("nqk,nk->nq", by_cone, shifts)
    )


def _left_over(
    views: tuple[CameraView, ...],
    step: FloatArray,
    shifts: FloatArray,
    unknown: FloatArray,
) -> FloatArray:
    """Return the residuals after a step, (N, C, L, 2), the jitter being an error."""
    n_leds = views[0].residuals.shape[1]
    by_led = step[-3 * n_leds :].reshape(n_leds, 3)
    by_diameter = step[-3 * n_leds - 1]
    cone = step[:N_CONE] + shifts
    if unknown.shape[1] > N_TURN:
        cone = cone + unknown[:, N_TURN:]
    row, left = N_CONE, []
    for view in views:
        own = step[row : row + view.own.shape[-1]]
        row += len(own)
        left.append(
            view.residuals
            - np.einsum("nlik,nk->nli", view.turn, unknown[:, :N_TURN])
            - np.einsum("nlik,nk->nli", view.cone, cone)
            - view.own @ own
            - view.diameter * by_diameter
            - np.einsum("nlik,lk->nli", view.led, by_led)
        )
    return np.stack(left, axis=1)


def _n_eliminated(
    each: Eliminated, jitter: FloatArray | None, used: BoolArray
) -> float:
    """Return how many unknowns the eliminated ones count for."""
    n_images = int(used.any(axis=(1, 2)).sum())
    if jitter is None:
        return float(N_TURN * n_images)
    known = np.linalg.inv(jitter)
    left = each.left[:, N_TURN:, N_TURN:]
    freedom = N_CONE - np.einsum("nij,ji->n", left, known)
    return float(N_TURN * n_images + freedom.sum())


def jitter_of(
    unknowns: Unknowns,
    each: NormalEquations,
    spread: FloatArray,
    seen: BoolArray,
    change: FloatArray,
    covariance: FloatArray,
) -> Jitter:
    """Return what is likely of the seat from image to image.

    Parameters
    ----------
    each : NormalEquations
        Without any jitter.
    spread : (N, 3, p) array
        Their rows of the cone by the unknowns.
    seen : (N,) array of bool
        Images that show anything.
    change : (p,) array
        Of the unknowns, that solves these equations.
    covariance : (p, p) array
        Of the unknowns.
    """
    step, shifts = unknowns.step(change)
    rows = each.cone_rows[seen]
    own = rows[..., :N_CONE]
    right = each.cone_right - each.cone_rows @ step
    right = right[seen] - np.einsum("nij,nj->ni", own, shifts[seen])
    noise = np.linalg.inv(own)
    told = noise @ spread[seen]
    # One product of all images is four times as fast as one of each.
    spread_out = told.reshape(-1, len(covariance)) @ covariance
    leverage = spread_out.reshape(told.shape) @ np.swapaxes(told, 1, 2)
    return find_jitter(own, right, leverage)
