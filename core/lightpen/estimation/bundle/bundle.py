"""Bundle adjustment with priors: minimises equation (2) of method.md.

Beside tip, cone and rotations the unknowns are the intrinsics of each camera, its
extrinsics in the rig, the LEDs, the pen's scale and the diameter of its discs, each
with a prior: the value of its file, with the uncertainty that the file states or that
is assumed in its place. Errors of the LEDs, of the seat as it follows the pen's lean
and of a drift are random effects, whose standard deviations are estimated from the
images (`lightpen.estimation.variance_components`).

The rotations are eliminated image by image [1]_, equation (3), so that other priors
need no new linearisation. The tip is given in the frame in which the file's LEDs fit
the true ones best: moves of the pen as a whole are no errors of its LEDs.

References
----------
.. [1] B. Triggs et al., "Bundle adjustment - a modern synthesis", LNCS 1883 (2000)
   298-372, section 6.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.robust_residuals import NOISE_FLOOR, robust_sigma
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.image_fields import (
    FieldName,
    ImageField,
    SeatModes,
    image_fields,
    seat_modes_of,
)
from lightpen.estimation.bundle.linearised import (
    N_CONE,
    N_TURN,
    BundleState,
    CameraView,
    Eliminated,
    eliminate,
    left_over,
    n_eliminated,
    own_step,
)
from lightpen.estimation.bundle.priors import Priors
from lightpen.estimation.bundle.unknowns import (
    NO_COMPONENTS,
    Components,
    ParameterLayout,
    Unknowns,
    find_components,
)
from lightpen.estimation.contact.joint import inliers
from lightpen.estimation.variance_components import RandomEffect, find_jitter
from lightpen.model.coverage import inverse

CONVERGED = 1e-5  # mm
FINEST = 1e-4  # px; exact data that weigh more drown the priors in rounding
FINDING_PASSES = 4  # at most, in which standard deviations are found; then they stand
MAX_PASSES = 20
SEAT_ROUNDS = 2  # of one step, in which the jitter is found beside other errors
OPPOSED = 0.5  # share of the last step; a step back by more is halved


@dataclass(frozen=True, eq=False)
class Bundle:
    """A solution of the bundle adjustment, with p unknowns."""

    unknowns: Unknowns
    state: BundleState  # state with adjusted cameras and pen
    values: FloatArray  # (p,), deviations from the files; tip and cone are 0
    components: Components  # standard deviations of the random effects in the fit
    # The same in the uncertainty budget: less than in the fit where correlated noise
    # explains a part of them.
    budget_components: Components
    # (N, C, L, 2), observed minus modelled centres, seat included, px; NaN: not seen.
    residuals: FloatArray
    used: BoolArray  # (N, C, L)
    sigma: float  # noise of one image coordinate, px
    # (p, p), N of equation (14), of the images, rotations eliminated.
    information: FloatArray
    prior_information: FloatArray  # (p, p), L of equation (14)
    # (p, p), M of equation (14), of disc areas.
    measured_information: FloatArray
    # (p, p), J of equation (15): covariance of the gradient by significant seat jitter.
    jitter_information: FloatArray
    # (p, p), the same of the expected jitter if it is not significant.
    insignificant_jitter: FloatArray
    # Standard deviation that weights LEDs, px; above ``sigma`` by correlated noise.
    weight_sigma: float
    covariance: FloatArray  # (p, p), P of equation (14), images taken as independent

    @cached_property
    def effective(self) -> FloatArray:
        """The effective (tip_pen, cone_rig) by the unknowns, (6, p)."""
        return self.unknowns.effective(self.state.rotations)

    @cached_property
    def gain(self) -> FloatArray:
        """The effective (tip_pen, cone_rig) by the right side, (6, p)."""
        return np.asarray(self.effective @ self.covariance)

    @property
    def tip_pen(self) -> FloatArray:
        """Effective tip, (3,), mm."""
        return np.asarray(self.state.tip_pen + self._followed[:3])

    @property
    def cone_rig(self) -> FloatArray:
        """Centre of the ball that goes with it, (3,), mm."""
        return np.asarray(self.state.cone_rig + self._followed[3:])

    @property
    def _followed(self) -> FloatArray:
        return np.asarray(self.effective[:, 6:] @ self.values[6:])

    @cached_property
    def budget_prior(self) -> FloatArray:
        """Prior information with the components of the budget, (p, p)."""
        if self.budget_components is self.components:
            return self.prior_information
        return self.unknowns.prior_information(self.budget_components)

    @property
    def right(self) -> FloatArray:
        """Right side of images and measurements, without priors, (p,)."""
        known = self.information + self.measured_information + self.prior_information
        return np.asarray(known @ self.values - self.unknowns.prior_right())

    @property
    def layout(self) -> ParameterLayout:
        """Layout of ``values`` and of every matrix."""
        return self.unknowns.layout

    @property
    def scale(self) -> float:
        """Scale of the pen in the swing against its file, relative."""
        return float(self.values[self.layout.scale][0])

    @property
    def drift(self) -> float:
        """Largest distance between two positions of the drifting cone, mm."""
        at, unknowns = self.layout, self.unknowns
        by_form = self.values[at.drift].reshape(-1, N_CONE)
        places = unknowns.forms[:, -len(by_form) :] @ by_form
        apart = np.linalg.norm(places[:, None] - places, axis=2)
        return float(apart.max())

    @property
    def field_shifts(self) -> FloatArray:
        """Fitted shift of each LED's image by fields, (N, C, L, 2), px."""
        sizes = self.values[self.layout.extrinsics.stop : self.layout.diameter.start]
        return np.asarray(self.unknowns.field_columns @ sizes)

    def lens_shifts(self, camera: int) -> FloatArray | None:
        """Return the lens field fitted at each LED, (N, L, 2), px; None if none."""
        for field, at in zip(self.unknowns.fields, self.layout.fields, strict=True):
            if (field.name, field.camera) == (FieldName.LENS, camera):
                return np.asarray(field.columns[:, camera] @ self.values[at])
        return None

    @property
    def cone_moves(self) -> FloatArray:
        """Fitted shift of the cone of each image by seat and drift, (N, 3), mm."""
        by_form = self.values[self.layout.seat[0].start :].reshape(-1, N_CONE)
        return np.asarray(self.unknowns.forms @ by_form)

    def part(self, *kinds: slice) -> FloatArray:
        """Return the covariance of (tip, cone) by errors of some priors, (6, 6), mm^2.

        Of equation (16), by priors and measurements of these unknowns.
        """
        known = self.prior_information + self.measured_information
        own = np.zeros_like(self.covariance)
        for at in kinds:
            own[at, at] = known[at, at]
        return self.propagated(own)

    def component_contribution(self, at: slice) -> FloatArray:
        """Return the covariance of (tip, cone) by LEDs or drift, (6, 6), mm^2.

        Of equation (17): fitted with one variance, budgeted with another.
        """
        gain = self.gain[:, at] @ self.prior_information[at, at]
        return np.asarray(gain @ inverse(self.budget_prior[at, at]) @ gain.T)

    def propagated(self, information: FloatArray) -> FloatArray:
        """Return P I P of tip and cone, (6, 6), mm^2, of a part I of N + L + M."""
        return np.asarray(self.gain @ information @ self.gain.T)

    @property
    def independent_noise(self) -> FloatArray:
        """Covariance of (tip, cone) by independent noise, (6, 6): equation (15)."""
        noise = self.propagated(self.information - self.jitter_information)
        return noise * (self.sigma / self.weight_sigma) ** 2


def fit_bundle(
    pixels: FloatArray,
    start: BundleState,
    priors: Priors,
    modes: SeatModes,
    inflation: float,
    places: FloatArray | None = None,
    fields: tuple[ImageField, ...] = (),
    noise: FloatArray | None = None,
    begin: Bundle | None = None,
) -> Bundle:
    """Fit tip, cone and the parameters of the files to the LED centres.

    Raises `CalibrationError` if the iteration does not settle.

    Parameters
    ----------
    pixels : (N, C, L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen.
    start : BundleState
        Start values, with cameras and pen as in their files.
    inflation : float
        Factor on the variance of the noise beside the priors, for correlated noise.
    places : (6 (C - 1),) array, optional
        Start of the extrinsics less those of the rig file; 0 unless given.
    fields : tuple of ImageField
        To be fitted.
    noise : (C, L) or (N, C, L) array, optional
        Noise of the LEDs' centres, by that of a usual one.
    begin : Bundle, optional
        Another solution for these images, from which the iteration begins.
    """
    unknowns = Unknowns.of(start, priors, modes, fields, noise)
    now = (
        _started(unknowns, start, pixels, places)
        if begin is None
        else _begun(unknowns, begin, pixels)
    )
    last = np.zeros(2 * N_CONE)
    # Another solution has its jitter already.
    for n_pass in range(0 if begin is None else 2, MAX_PASSES):
        weight_sigma = max(now.sigma * float(np.sqrt(inflation)), FINEST)
        finding = 0 < n_pass <= FINDING_PASSES
        # The jitter first: without it, other random effects would absorb it.
        solved = _solve(unknowns, now, weight_sigma, finding and n_pass > 1)
        components, used = solved.components, now.used
        if finding:
            jitter = _jitter_beside(unknowns, now, solved, weight_sigma)
            components = components._replace(jitter=jitter)
            used = inliers(_together(solved.residuals)).reshape(used.shape)
        is_same = np.array_equal(used, now.used)
        is_same &= components.sigmas == now.components.sigmas
        change = solved.values - now.values
        step = change[: len(last)]
        if n_pass > 1 and is_same and np.abs(step).max() < CONVERGED:
            state = unknowns.moved(now.state, solved.values, solved.turns)
            return _bundle_of(unknowns, state, now.used, solved, weight_sigma)
        is_opposed = step @ last < -OPPOSED * (last @ last)
        share = 0.5 if is_opposed and not finding else 1.0
        last = share * step
        values = now.values + share * change
        state = unknowns.moved(now.state, values, share * solved.turns)
        views = unknowns.views_at(state, pixels)
        values = _held_by_state(unknowns, values)
        now = _Linearised(state, values, views, used, components, solved.sigma)
    raise CalibrationError("bundle.not-settled", n_steps=MAX_PASSES)


class _Linearised(NamedTuple):
    """The images about a state of the iteration.

    ``values`` (p,) are the deviations of the state from the files.
    """

    state: BundleState
    values: FloatArray
    views: tuple[CameraView, ...]
    used: BoolArray
    components: Components
    sigma: float


class Solved(NamedTuple):
    """The linear solution about a state: matrices as of `Bundle`."""

    eliminated: Eliminated
    information: FloatArray
    prior: FloatArray
    measured: FloatArray
    covariance: FloatArray
    values: FloatArray
    turns: FloatArray
    residuals: FloatArray
    components: Components
    sigma: float


def solved_at_rest(bundle: Bundle, pixels: FloatArray) -> tuple[Solved, FloatArray]:
    """Return the linear solution about a fit without drift and seat, but with jitter.

    And its step from the fit, (p,); ``pixels`` (N, C, L, 2) as fitted, px.
    """
    now = _begun(bundle.unknowns, bundle, pixels)
    components = NO_COMPONENTS._replace(
        leds=bundle.components.leds,
        jitter=bundle.components.jitter,
        fields=bundle.components.fields,
    )
    now = now._replace(components=components)
    solved = _solve(bundle.unknowns, now, bundle.weight_sigma, with_components=False)
    return solved, solved.values - now.values


def one_step(
    pixels: FloatArray,
    state: BundleState,
    priors: Priors,
    used: BoolArray,
    sigma: float,
) -> Bundle:
    """Return the adjustment after one step about a state, all of whose LEDs are known.

    ``pixels`` (N, C, L, 2), px, are as in `fit_bundle`; those ``used`` (N, C, L) have a
    noise ``sigma``, px.
    """
    fields = image_fields(pixels, used, state)
    unknowns = Unknowns.of(state, priors, seat_modes_of(state.rotations), fields)
    views = unknowns.views_at(state, pixels)
    values, components = np.zeros(unknowns.number), NO_COMPONENTS.with_no_fields(fields)
    now = _Linearised(state, values, views, used, components, sigma)
    solved = _solve(unknowns, now, sigma, with_components=False)
    for _ in range(SEAT_ROUNDS):
        # The jitter first: without it, other random effects would absorb it.
        jitter = _jitter_beside(unknowns, now, solved, sigma)
        now = now._replace(components=solved.components._replace(jitter=jitter))
        solved = _solve(unknowns, now, sigma, with_components=True)
    return _bundle_of(unknowns, state, used, solved._replace(sigma=sigma), sigma)


def _started(
    unknowns: Unknowns,
    start: BundleState,
    pixels: FloatArray,
    places: FloatArray | None,
) -> _Linearised:
    """Linearise the images at the start, with the given extrinsics."""
    state, values = start, np.zeros(unknowns.number)
    if places is not None:
        values[unknowns.layout.extrinsics] = places
        state = unknowns.moved(start, values, np.zeros((len(pixels), N_TURN)))
    views = unknowns.views_at(state, pixels)
    residuals = np.stack([view.residuals for view in views], axis=1)
    used = inliers(_together(residuals)).reshape(residuals.shape[:-1])
    sigma = robust_sigma(_together(residuals), N_TURN)
    components = NO_COMPONENTS.with_no_fields(unknowns.fields)
    return _Linearised(state, values, views, used, components, sigma)


def _begun(unknowns: Unknowns, begin: Bundle, pixels: FloatArray) -> _Linearised:
    """Linearise the images about another solution."""
    values, at, of = np.zeros(unknowns.number), unknowns.layout, begin.layout
    for place, known in zip(at.of_files, of.of_files, strict=True):
        values[place] = begin.values[known]
    for place, known in zip(at.cameras, of.cameras, strict=True):
        values[place] = begin.values[known]
    views = unknowns.views_at(begin.state, pixels)
    return _Linearised(
        begin.state, values, views, begin.used, begin.components, begin.sigma
    )


def _solve(
    unknowns: Unknowns, now: _Linearised, weight_sigma: float, with_components: bool
) -> Solved:
    """Solve the normal equations about a state, with new components if requested."""
    components, used = now.components, now.used
    jitter = components.jitter.covariance
    eliminated = eliminate(now.views, used, weight_sigma, jitter)
    information, gradient = unknowns.system(eliminated)
    measured, measured_right = unknowns.measured()
    right = gradient + information @ now.values + measured_right
    if with_components:
        components = find_components(
            unknowns, information + measured, right, components
        )
    prior = unknowns.prior_information(components)
    covariance = inverse(information + prior + measured)
    values = covariance @ (right + unknowns.prior_right())
    step, shifts = unknowns.step(values - now.values)
    own = own_step(eliminated, step, shifts)
    residuals = left_over(now.views, step, shifts, own)
    n_fitted = float(np.sum(covariance * information))
    n_fitted += n_eliminated(eliminated, jitter, used)
    squares = np.where(used[..., None], residuals, 0.0) ** 2
    n_free = max(2 * int(used.sum()) - n_fitted, 1.0)
    sigma = max(float(np.sqrt(squares.sum() / n_free)), NOISE_FLOOR)
    return Solved(
        eliminated,
        information,
        prior,
        measured,
        covariance,
        values,
        own[:, :N_TURN],
        residuals,
        components,
        sigma,
    )


def _jitter_beside(
    unknowns: Unknowns, now: _Linearised, solved: Solved, weight_sigma: float
) -> RandomEffect:
    """Estimate the jitter of the seat about a solution."""
    each = solved.eliminated
    if solved.components.jitter.covariance is not None:
        each = eliminate(now.views, now.used, weight_sigma)
    seen = np.asarray(now.used.any(axis=(1, 2)))
    step, shifts = unknowns.step(solved.values - now.values)
    own = each.cone_rows[seen, :, :N_CONE]
    right = each.cone_right - each.cone_rows @ step
    right = right[seen] - np.einsum("nij,nj->ni", own, shifts[seen])
    by_image = np.linalg.inv(own) @ unknowns.sensitivity(each.cone_rows)[seen]
    # One product of all images is four times as fast as one of each.
    spread = by_image.reshape(-1, unknowns.number) @ solved.covariance
    leverage = spread.reshape(by_image.shape) @ np.swapaxes(by_image, 1, 2)
    return find_jitter(own, right, leverage)


def _held_by_state(unknowns: Unknowns, values: FloatArray) -> FloatArray:
    """Return the values that the state contains."""
    at, held = unknowns.layout, values.copy()
    for kind in (at.tip, at.cone, *at.fields, *at.seat, at.drift):
        held[kind] = 0.0
    return held


def _bundle_of(
    unknowns: Unknowns,
    state: BundleState,
    used: BoolArray,
    solved: Solved,
    weight_sigma: float,
) -> Bundle:
    jitter, eliminated = solved.components.jitter, solved.eliminated
    by_seat = eliminated.turn_by_step[:, N_TURN:]
    rows = eliminated.cone_rows if jitter.covariance is None else by_seat
    significant, insignificant = _jitter_matrices(jitter, unknowns.sensitivity(rows))
    return Bundle(
        unknowns=unknowns,
        state=state,
        values=solved.values,
        components=solved.components,
        budget_components=solved.components,
        residuals=solved.residuals * unknowns.noise[..., None],
        used=used,
        sigma=solved.sigma,
        information=solved.information,
        prior_information=solved.prior,
        measured_information=solved.measured,
        jitter_information=significant,
        insignificant_jitter=insignificant,
        weight_sigma=weight_sigma,
        covariance=solved.covariance,
    )


def _jitter_matrices(
    jitter: RandomEffect, rows: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ``jitter_information`` and ``insignificant_jitter`` of a `Bundle`.

    ``rows`` (N, 3, p) are the derivative of the seat of each image by the unknowns,
    where jitter is fitted; else the rows of its cone in the normal equations.
    """
    nothing = np.zeros((rows.shape[-1],) * 2)
    if jitter.covariance is None:
        flat = jitter.expected_sigma * rows.reshape(-1, rows.shape[-1])
        return nothing, flat.T @ flat
    known = np.linalg.inv(jitter.covariance)
    return np.einsum("nip,ij,njq->pq", rows, known, rows, optimize=True), nothing


def _together(residuals: FloatArray) -> FloatArray:
    """Return residuals (N, C, L, 2) with the LEDs of all cameras in one row."""
    return residuals.reshape(len(residuals), -1, 2)
