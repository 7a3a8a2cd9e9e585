"""The unknowns of a bundle adjustment: where they stand, and what is known of them.

Tip, cone, cameras, LEDs and the like are combinations of the columns of
`lightpen.estimation.linearised`; the forms of the seat and a drift shift the cone of
each image by a weight of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.linearised import N_CONE, BundleState, NormalEquations
from lightpen.estimation.priors import Priors
from lightpen.estimation.variance_components import (
    FITTED,
    Component,
    Jitter,
    find_beside,
    find_component,
)
from lightpen.model.rigid import rotation_from_vector, skew

ROUNDS = 3  # of finding each component beside the others
FULL_LEAN = 0.15  # sine of the tilt from which on a seat shows most of its form
FORMS = (2, 2, 2, 1)  # of one, two, three waves round the cone, and of the tilt
UPRIGHT = 0.966  # cosine of 15 degrees, to which 15 images tell where a cone opens
SMALLEST = 1e-9  # size of a form; less is rounding
EXACT = 1e-6  # standard deviation of what is taken as exact, in its own unit
NONE = Component(0.0, 0.0)


class Columns(NamedTuple):
    """Where each kind of unknown stands; the seat by the kinds of its forms."""

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

    @property
    def whole_seat(self) -> slice:
        """Where all forms of the seat stand."""
        return slice(self.seat[0].start, self.seat[-1].stop)


class Components(NamedTuple):
    """Standard deviations that the images tell.

    Attributes
    ----------
    leds : Component
        Of one LED coordinate, mm; none where the file states it and the images do
        not deny it.
    seat : tuple of Component
        Of the seat by each kind of form in which it may follow the lean, mm.
    oval : Component
        Of the two numbers of an oval seat, see `oval_seat`, mm.
    drift : Component
        Of the cone over the whole of each of its ways, mm.
    jitter : Jitter
        Of the seat from image to image.
    """

    leds: Component
    seat: tuple[Component, ...]
    oval: Component
    drift: Component
    jitter: Jitter


NO_COMPONENTS = Components(NONE, (NONE,) * len(FORMS), NONE, NONE, Jitter(None, 0.0))


class Forms(NamedTuple):
    """Weights by which images may shift their cone.

    Attributes
    ----------
    lean : (N, 7) array
        As the pen leans, see `lean_forms`.
    oval : (21, 2) array
        Moves in each of these forms that an oval seat makes, see `oval_seat`.
    drift : (N, D) array
        In the course of the swing, see `drift_forms`.
    """

    lean: FloatArray
    oval: FloatArray
    drift: FloatArray


def forms_of(rotations: FloatArray, shifts: FloatArray | None = None) -> Forms:
    """Return the forms of images with these rotations (N, 3, 3) of rig_from_pen.

    Parameters
    ----------
    shifts : (N, k) array, optional
        Ways of fixed lamps, see `drift_forms`.
    """
    lean, oval = lean_forms(rotations), oval_seat(rotations)
    return Forms(lean, oval, drift_forms(len(rotations), shifts))


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
    forms, sizes = _lean(rotations)
    return np.asarray(forms / np.where(sizes > 0, sizes, 1.0))


def oval_seat(rotations: FloatArray) -> FloatArray:
    """Return the moves in the forms of the lean that an oval seat makes, (21, 2).

    A ball or cone with two lobes, 1 mm off the circle, moves the tip by
    ``cos(2 (angle - phase))`` mm away from the axis as the pen leans to an angle: by
    one wave and three waves round the cone, of which three waves are well seen. The
    two columns are the cosine and sine of twice the phase.

    Parameters
    ----------
    rotations : (N, 3, 3) array
        Of rig_from_pen.
    """
    _, sizes = _lean(rotations)
    cos1, sin1, _, _, cos3, sin3, _ = np.eye(len(sizes)) * sizes
    right, away, _ = axes_of_cone(rotations)
    cosine = np.outer(cos1 + cos3, right) + np.outer(sin3 - sin1, away)
    sine = np.outer(sin1 + sin3, right) + np.outer(cos1 - cos3, away)
    return np.stack([0.5 * cosine.ravel(), 0.5 * sine.ravel()], axis=1)


def axes_of_cone(rotations: FloatArray) -> FloatArray:
    """Return the axes of the cone in the rig, one a row: two across, one along, (3, 3).

    Before a camera that looks at it from its side they are right, away, and up. Where
    the pen points elsewhere on average by more than images are drawn unevenly, it is
    the camera that looks down or lies on its side: the cone opens to where it points.

    Parameters
    ----------
    rotations : (N, 3, 3) array
        Of rig_from_pen.
    """
    along = rotations[:, :, 1].mean(axis=0)
    along /= np.linalg.norm(along)
    if abs(along[1]) > UPRIGHT:
        along = np.array([0.0, np.copysign(1.0, along[1]), 0.0])
    most_across = np.eye(N_CONE)[np.argmin(np.abs(along).round(1))]
    right = most_across - (most_across @ along) * along
    right /= np.linalg.norm(right)
    return np.array([right, skew(along) @ right, along])


def _lean(rotations: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the forms of the lean less their means, (N, 7), and their sizes, (7,)."""
    right, away, _ = axes_of_cone(rotations) @ rotations[:, :, 1].T
    radius = np.hypot(right, away)
    weight = radius / (radius + FULL_LEAN)
    angle = np.arctan2(away, right)
    waves = [f(n * angle) * weight for n in (1, 2, 3) for f in (np.cos, np.sin)]
    forms = np.stack([*waves, weight**2], axis=1)
    forms -= forms.mean(axis=0)
    sizes = np.sqrt(np.mean(forms**2, axis=0))
    is_there = sizes > SMALLEST
    return np.where(is_there, forms, 0.0), np.where(is_there, sizes, 0.0)


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
    oval : (21, 2) array
        Moves in the forms of the lean by an oval seat.
    basis : (3 L, 3 L - 6) array
        Moves of LEDs but those of the pen as a whole.
    scaling : (3 L,) array
        Move of the LEDs by a scale of 1.
    """

    columns: Columns
    start: BundleState
    mixing: FloatArray
    forms: FloatArray
    oval: FloatArray
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
        return cls(columns, start, mixing, forms, given.oval, basis, scaling, priors)

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
        for place, sigma in (
            (at.leds, max(components.leds.sigma, priors.led_sigma or 0.0)),
            (at.drift, components.drift.sigma),
        ):
            n = place.stop - place.start
            prior[place, place] = np.eye(n) / max(sigma, EXACT) ** 2
        variances, oval = self._seat_variances(components), components.oval.sigma
        prior[at.whole_seat, at.whole_seat] = (
            inverse(np.diag(variances) + oval**2 * self.oval @ self.oval.T)
            if oval > 0
            else np.diag(1 / variances)
        )
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

    def _seat_variances(self, components: Components) -> FloatArray:
        """Return the variances of the moves in each form, but for an oval, (21,)."""
        one_wave, *others = (each.sigma for each in components.seat)
        # A seat that goes once round with the pen is hardly seen beside the tip:
        # nothing says that it does so less than in any other form.
        sigmas = np.array([max(one_wave, *others), *others])
        by_kind = np.maximum(sigmas, max(self.priors.form_error, EXACT)) ** 2
        return np.repeat(by_kind, N_CONE * np.array(FORMS))

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
            if _sigmas(now) == _sigmas(known):  # as they would be once more
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

        def own(place: slice) -> tuple[FloatArray, FloatArray]:
            known = inverse(covariance[place, place])
            return known - prior[place, place], known @ values[place]

        def find(place: slice, stated: float = 0.0) -> Component:
            return find_component(*own(place), stated)

        oval, seat = self._found_seat(*own(at.whole_seat), before)
        return before._replace(
            leds=self._found_leds(find),
            seat=seat,
            oval=oval,
            drift=_likely(find(at.drift)),
        )

    def _found_seat(
        self, information: FloatArray, right: FloatArray, before: Components
    ) -> tuple[Component, tuple[Component, ...]]:
        """Return the component of an oval seat, and those of its forms.

        An oval is made of waves, and either may stand for the other. The likelier is
        fitted; the other counts by how likely it is beside that.

        Parameters
        ----------
        information : (21, 21) array
            Of all forms, without any prior.
        right : (21,) array
            Right side that belongs to it.
        """
        find = partial(find_beside, information, right)
        truest = self._seat_variances(NO_COMPONENTS)
        alone = find(self.oval, np.diag(truest))
        waves_alone = found = self._found_waves(find, truest, NONE)
        ahead = 0.5 * (alone.gain - max(wave.gain for wave in waves_alone))
        oval = _likely(alone) if ahead >= 0 else NONE
        variances = self._seat_variances(before)
        if oval.sigma > 0 or (variances > truest).any():
            found = self._found_waves(find, variances, oval)
        waves = tuple(_likely(wave, self.priors.form_error) for wave in found)
        if oval.sigma > 0:
            doubt = float(np.exp(-0.5 * np.logaddexp(0.0, ahead)))
            waves = tuple(
                wave._replace(expected=max(wave.expected, doubt * other.sigma))
                for wave, other in zip(waves, waves_alone, strict=True)
            )
        elif any(wave.sigma > 0 for wave in waves):
            doubt = float(np.exp(-0.5 * np.logaddexp(0.0, -ahead)))
            oval = NONE._replace(expected=doubt * alone.sigma)
        else:
            oval = NONE._replace(expected=alone.expected)
        return oval, waves

    def _found_waves(
        self, find: Callable[..., Component], variances: FloatArray, oval: Component
    ) -> list[Component]:
        """Return the component of each kind, beside the variances of the others."""
        by_oval = oval.sigma**2 * self.oval @ self.oval.T
        first = self.columns.whole_seat.start
        waves = []
        for place in self.columns.seat:
            some = slice(place.start - first, place.stop - first)
            others = variances.copy()
            others[some] = 0.0
            moves = np.eye(len(variances))[:, some]
            beside_it = by_oval + np.diag(others)
            waves.append(find(moves, beside_it, self.priors.form_error))
        return waves

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


def _sigmas(components: Components) -> list[float]:
    """Return the standard deviations by which the unknowns are fitted, mm."""
    found = (components.leds, *components.seat, components.oval, components.drift)
    return [each.sigma for each in found]


def _likely(found: Component, stated: float = 0.0) -> Component:
    """Return a component where it is likely enough to be fitted, else none."""
    if found.sigma > stated and found.gain > FITTED:
        return found
    return NONE._replace(expected=found.expected)


def led_basis(leds: FloatArray) -> FloatArray:
    """Return all moves of LEDs but those of the pen as a whole, (3 L, 3 L - 6)."""
    return np.asarray(np.linalg.qr(whole_moves(leds), mode="complete")[0][:, 6:])


def whole_moves(leds: FloatArray) -> FloatArray:
    """Return the moves of LEDs by those of the pen as a whole, (3 L, 6).

    Its shifts, mm, and its turns about the middle of the LEDs, rad.
    """
    shifts = np.tile(np.eye(3), (len(leds), 1))
    turns = -skew(leds - leds.mean(axis=0)).reshape(-1, 3)
    return np.concatenate([shifts, turns], axis=1)


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
