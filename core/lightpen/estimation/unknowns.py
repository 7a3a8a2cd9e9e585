"""The unknowns of a bundle adjustment: where they stand, and what is known of them.

Tip, cone, cameras, LEDs and the like are combinations of the columns of
`lightpen.estimation.linearised`; the forms of the seat and a drift shift the cone of
each image by a weight of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.linearised import N_CONE, BundleState, NormalEquations
from lightpen.estimation.priors import Priors
from lightpen.estimation.variance_components import (
    FITTED,
    Component,
    Jitter,
    find_component,
)
from lightpen.model.rigid import rotation_from_vector, skew

ROUNDS = 3  # of finding each component beside the others
FULL_LEAN = 0.15  # sine of the tilt from which on a seat shows most of its form
FORMS = (2, 2, 2, 1)  # of one, two, three waves round the cone, and of the tilt
EXACT = 1e-6  # standard deviation of what is taken as exact, in its own unit
NONE = Component(0.0, 0.0)


class Columns(NamedTuple):
    """Where each kind of unknown stands."""

    tip: slice
    cone: slice
    cameras: tuple[slice, ...]
    extrinsics: slice
    diameter: slice
    scale: slice
    leds: slice
    seat: tuple[slice, ...]
    drift: slice
    between: slice


class Components(NamedTuple):
    """Standard deviations that the images tell.

    Attributes
    ----------
    leds : Component
        Of one LED coordinate, mm; none where the file states it and the images do
        not deny it.
    seat : tuple of Component
        Of the seat by each kind of form in which it may follow the lean, mm.
    drift : Component
        Of the cone over the whole of each of its ways, mm.
    jitter : Jitter
        Of the seat from image to image.
    """

    leds: Component
    seat: tuple[Component, ...]
    drift: Component
    jitter: Jitter


NO_COMPONENTS = Components(NONE, (NONE,) * len(FORMS), NONE, Jitter(None, 0.0))


class Forms(NamedTuple):
    """Weights by which images may shift their cone.

    Attributes
    ----------
    lean : (N, 7) array
        As the pen leans, see `lean_forms`.
    drift : (N, D) array
        In the course of the swing, see `drift_forms`.
    """

    lean: FloatArray
    drift: FloatArray


def drift_forms(n_images: int, shifts: FloatArray | None = None) -> FloatArray:
    """Return the forms in which a cone may drift, (N, D), each over a range of 1.

    Evenly in time, and along the ways that lamps in view go.

    Parameters
    ----------
    shifts : (N, k) array, optional
        These ways, px.
    """
    time = np.linspace(-0.5, 0.5, n_images)[:, None]
    if shifts is None or n_images == 0:
        return time
    ranges = np.ptp(shifts, axis=0)
    return np.column_stack([time, shifts[:, ranges > 0] / ranges[ranges > 0]])


def lean_forms(rotations: FloatArray) -> FloatArray:
    """Return the forms in which a seat may follow the lean of a pen, (N, 7).

    Waves of one to three periods round the cone and one that goes with the tilt, less
    their means, each of mean square 1 (or 0).

    Parameters
    ----------
    rotations : (N, 3, 3) array
        Of rig_from_pen.
    """
    x, z = rotations[:, 0, 1], rotations[:, 2, 1]
    radius = np.hypot(x, z)
    weight = radius / (radius + FULL_LEAN)
    angle = np.arctan2(z, x)
    waves = [f(n * angle) * weight for n in (1, 2, 3) for f in (np.cos, np.sin)]
    forms = np.stack([*waves, weight**2], axis=1)
    forms -= forms.mean(axis=0)
    sizes = np.sqrt(np.mean(forms**2, axis=0))
    return np.asarray(forms / np.where(sizes > 0, sizes, 1.0))


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The unknowns of a fit as combinations of the columns of `NormalEquations`.

    Attributes
    ----------
    columns : Columns
        Where each kind stands.
    mixing : (K, p0) array
        Columns of `NormalEquations` by the unknowns common to all images.
    forms : (N, m) array
        Weights by which each image shifts its cone: the lean, then the drift, then
        whether it is at the second cone.
    basis : (3 L, 3 L - 6) array
        Moves of LEDs but those of the pen as a whole.
    scaling : (3 L,) array
        Move of the LEDs by a scale of 1.
    """

    columns: Columns
    start: BundleState
    mixing: FloatArray
    forms: FloatArray
    basis: FloatArray
    scaling: FloatArray
    priors: Priors

    @classmethod
    def of(cls, start: BundleState, priors: Priors, given: Forms) -> "Unknowns":
        """Return the unknowns of a fit that starts there."""
        rig, pen = start.rig, start.pen
        n_leds = pen.n_leds
        sizes = [len(camera.intrinsics) for camera in rig.cameras]
        n_extrinsics = 6 * (rig.n_cameras - 1)
        basis = led_basis(pen.leds)
        counts = [3, 3, *sizes, n_extrinsics, 1, 1, basis.shape[1]]
        counts += [3 * n_forms for n_forms in FORMS]
        n_drifts = given.drift.shape[1]
        counts += [3 * n_drifts, 0 if start.at_second is None else 3]
        ends = np.cumsum(counts).tolist()
        slices = [slice(end - n, end) for n, end in zip(counts, ends, strict=True)]
        tip, cone, *others = slices
        cameras, others = others[: len(sizes)], others[len(sizes) :]
        extrinsics, diameter, scale, leds, *seat, drift, between = others
        columns = Columns(
            tip=tip,
            cone=cone,
            cameras=tuple(cameras),
            extrinsics=extrinsics,
            diameter=diameter,
            scale=scale,
            leds=leds,
            seat=tuple(seat),
            drift=drift,
            between=between,
        )
        scaling = (pen.leds - pen.leds.mean(axis=0)).ravel()
        K = N_CONE + sum(sizes) + n_extrinsics + 1 + 3 * n_leds
        mixing = np.zeros((K, columns.leds.stop))
        at_leds = slice(K - 3 * n_leds, K)
        mixing[at_leds, columns.tip] = -np.tile(np.eye(3), (n_leds, 1))
        mixing[:N_CONE, columns.cone] = np.eye(3)
        row = N_CONE
        for c, at in enumerate(columns.cameras):
            mixing[row : row + sizes[c], at] = np.eye(sizes[c])
            row += sizes[c]
            if c > 0:
                place = columns.extrinsics.start + 6 * (c - 1)
                mixing[row : row + 6, place : place + 6] = np.eye(6)
                row += 6
        mixing[row, columns.diameter] = 1.0
        mixing[at_leds, columns.scale.start] = scaling
        mixing[at_leds, columns.leds] = basis
        second = () if start.at_second is None else (start.at_second.astype(float),)
        forms = np.column_stack([given.lean, given.drift, *second])
        return cls(columns, start, mixing, forms, basis, scaling, priors)

    @property
    def number(self) -> int:
        """How many there are, rotations apart."""
        return int(self.columns.between.stop)

    def system(self, each: NormalEquations) -> tuple[FloatArray, FloatArray]:
        """Return information (p, p) and gradient (p,) of the unknowns."""
        mixing, forms = self.mixing, self.forms
        p0, p = mixing.shape[1], self.number
        information = np.empty((p, p))
        information[:p0, :p0] = mixing.T @ each.N @ mixing
        rows = np.tensordot(forms, each.cone_rows, axes=(0, 0))  # (m, 3, K)
        information[p0:, :p0] = rows.reshape(p - p0, -1) @ mixing
        information[:p0, p0:] = information[p0:, :p0].T
        m = forms.shape[1]
        products = (forms[:, :, None] * forms[:, None]).reshape(-1, m * m)
        own = products.T @ each.cone_rows[..., :N_CONE].reshape(-1, N_CONE**2)
        own = np.swapaxes(own.reshape(m, m, N_CONE, N_CONE), 1, 2)
        information[p0:, p0:] = own.reshape(p - p0, p - p0)
        gradient = np.concatenate(
            [mixing.T @ each.b, (forms.T @ each.cone_right).ravel()]
        )
        return 0.5 * (information + information.T), gradient

    def step(self, change: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return a change of the unknowns as a step (K,) and shifts of cones (N, 3)."""
        p0 = self.mixing.shape[1]
        shifts = self.forms @ change[p0:].reshape(-1, 3)
        return self.mixing @ change[:p0], shifts

    def sensitivity(self, rows: FloatArray) -> FloatArray:
        """Return rows (N, 3, K) of the cone by the unknowns, (N, 3, p)."""
        n_images, p0 = len(rows), self.mixing.shape[1]
        sensitivity = np.empty((n_images, N_CONE, self.number))
        flat = rows.reshape(-1, rows.shape[-1])
        sensitivity[..., :p0] = (flat @ self.mixing).reshape(n_images, N_CONE, p0)
        own = self.forms[:, None, :, None] * rows[:, :, None, :N_CONE]
        sensitivity[..., p0:] = own.reshape(n_images, N_CONE, -1)
        return sensitivity

    def prior_information(self, components: Components) -> FloatArray:
        """Return what is known of them before the images, (p, p)."""
        at, priors = self.columns, self.priors
        prior = self._of_files.copy()
        for place, sigma in self._sigmas(components):
            n = place.stop - place.start
            prior[place, place] = np.eye(n) / max(sigma, EXACT) ** 2
        of_leds = priors.led_covariance
        if of_leds is not None and components.leds is NONE:  # the images do not deny it
            known = self.basis.T @ of_leds @ self.basis
            prior[at.leds, at.leds] = inverse(known + EXACT**2 * np.eye(len(known)))
        return prior

    @cached_property
    def _of_files(self) -> FloatArray:
        """What files state, or what is assumed in their place, but for LEDs; (p, p)."""
        at, priors = self.columns, self.priors
        prior = np.zeros((self.number, self.number))
        for place, each in zip(at.cameras, priors.cameras, strict=True):
            prior[place, place] = known_by(each.covariance)
        if priors.extrinsics is not None:
            prior[at.extrinsics, at.extrinsics] = known_by(priors.extrinsics.covariance)
        prior[at.diameter, at.diameter] = known_by(priors.diameter.covariance)
        prior[at.scale, at.scale] = known_by(priors.size_covariance)
        return prior

    def measured(
        self, state: BundleState, values: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return what was measured beside the centres: information and right side.

        Parameters
        ----------
        values : (p,) array
            Those at the state.

        Returns
        -------
        information : (p, p) array
        right : (p,) array
        """
        at, priors = self.columns, self.priors
        information = np.zeros((self.number, self.number))
        right = np.zeros(self.number)
        if priors.reading is not None:
            weight = priors.reading.sigma**-2
            change = priors.reading.value - self.start.pen.diameter
            information[at.diameter, at.diameter] = weight
            right[at.diameter] = weight * change
        if priors.separation is not None:
            weight = priors.separation.sigma**-2
            distance = float(np.linalg.norm(state.between_rig))
            along = state.between_rig / distance
            change = priors.separation.distance - distance
            information[at.between, at.between] = weight * np.outer(along, along)
            right[at.between] = weight * along * (change + along @ values[at.between])
        return information, right

    def _sigmas(self, components: Components) -> list[tuple[slice, float]]:
        at, stated = self.columns, self.priors.led_sigma
        one_wave, *others = (each.sigma for each in components.seat)
        # A seat that goes once round with the pen is hardly seen beside the tip:
        # nothing says that it does so less than in any other form.
        seat = [max(one_wave, *others), *others]
        form_error = self.priors.form_error
        return [
            (at.leds, max(components.leds.sigma, stated or 0.0)),
            *((at, max(s, form_error)) for at, s in zip(at.seat, seat, strict=True)),
            (at.drift, components.drift.sigma),
        ]

    def found(
        self,
        information: FloatArray,
        right: FloatArray,
        before: Components,
    ) -> Components:
        """Return the components, each found beside the others."""
        now = before
        for _ in range(ROUNDS):
            known, now = now, self._found_once(information, right, now)
            if self._sigmas(now) == self._sigmas(known):  # as they would be once more
                break
        return now

    def _found_once(
        self,
        information: FloatArray,
        right: FloatArray,
        before: Components,
    ) -> Components:
        at, prior = self.columns, self.prior_information(before)
        covariance = inverse(information + prior)
        values = covariance @ right

        def find(place: slice, sigma: float = 0.0) -> Component:
            known = inverse(covariance[place, place])
            own = known - prior[place, place]
            return find_component(own, known @ values[place], sigma)

        def likely(place: slice, stated: float = 0.0) -> Component:
            component = find(place, stated)
            is_more = component.sigma > stated and component.gain > FITTED
            return component if is_more else NONE._replace(expected=component.expected)

        return before._replace(
            leds=self._found_leds(find),
            seat=tuple(likely(place, self.priors.form_error) for place in at.seat),
            drift=likely(at.drift),
        )

    def _found_leds(self, find: Callable[[slice, float], Component]) -> Component:
        stated, of_leds = self.priors.led_sigma, self.priors.led_covariance
        if of_leds is not None:  # the least known may be off by that much
            stated = float(np.sqrt(np.linalg.eigvalsh(of_leds)[-1]))
        component = find(self.columns.leds, stated or 0.0)
        if stated is None or (component.is_significant and component.sigma > stated):
            return component
        return NONE

    def moved(
        self, now: BundleState, values: FloatArray, turns: FloatArray
    ) -> BundleState:
        """Return the state by new values and the turn of each image, (N, 3)."""
        at, start, rig = self.columns, self.start, self.start.rig
        cameras = tuple(
            camera.with_intrinsics(camera.intrinsics + values[place])
            for camera, place in zip(rig.cameras, at.cameras, strict=True)
        )
        places = np.concatenate([np.zeros(6), values[at.extrinsics]]).reshape(-1, 6)
        leds = self.basis @ values[at.leds] + self.scaling * values[at.scale]
        between = start.between_rig
        if now.at_second is not None:
            between = between + values[at.between]
        return replace(
            now,
            rig=replace(
                rig,
                cameras=cameras,
                rotations=rotation_from_vector(places[:, :3]) @ rig.rotations,
                translations=rig.translations + places[:, 3:],
            ),
            pen=replace(
                start.pen,
                leds=start.pen.leds + leds.reshape(-1, 3),
                diameter=start.pen.diameter + float(values[at.diameter][0]),
            ),
            tip_pen=now.tip_pen + values[at.tip],
            cone_rig=now.cone_rig + values[at.cone],
            rotations=rotation_from_vector(turns) @ now.rotations,
            between_rig=between,
        )


def led_basis(leds: FloatArray) -> FloatArray:
    """Return all moves of LEDs but those of the pen as a whole, (3 L, 3 L - 6)."""
    shifts = np.tile(np.eye(3), (len(leds), 1))
    turns = -skew(leds - leds.mean(axis=0)).reshape(-1, 3)
    whole = np.concatenate([shifts, turns], axis=1)
    return np.asarray(np.linalg.qr(whole, mode="complete")[0][:, 6:])


def known_by(covariance: FloatArray) -> FloatArray:
    """Return the information in what is stated; what is so as exact may be rounded."""
    floor = np.maximum(np.diag(covariance) * EXACT, EXACT**2)
    return inverse(covariance + np.diag(floor))


def inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse of a positive matrix of unknowns in different units."""
    scale = 1 / np.sqrt(np.diag(matrix))
    scales = np.outer(scale, scale)
    inverse = np.linalg.inv(matrix * scales) * scales
    return np.asarray(0.5 * (inverse + inverse.T))
