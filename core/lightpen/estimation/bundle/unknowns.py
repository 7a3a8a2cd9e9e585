"""The unknowns of a bundle adjustment: their layout, system and priors.

Tip, cone, cameras, LEDs and the like are combinations of the columns of `linearised`;
seat modes and drift shift the cone of each image by its weights, equation (4) of
method.md.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.image_fields import (
    MODE_COUNTS,
    FieldComponent,
    ImageField,
    SeatModes,
    held,
    size_of,
)
from lightpen.estimation.bundle.linearised import (
    N_CONE,
    BundleState,
    CameraView,
    NormalEquations,
    views_at,
    whole_moves,
)
from lightpen.estimation.bundle.priors import Priors
from lightpen.estimation.variance_components import (
    FITTED,
    Component,
    RandomEffect,
    find_beside,
    find_component,
)
from lightpen.model.coverage import EXACT, inverse, known_by
from lightpen.model.pen import effective_tip
from lightpen.model.rigid import rotation_from_vector

NONE = Component(0.0, 0.0)


class Components(NamedTuple):
    """Estimated standard deviations of the random effects."""

    leds: Component  # of an LED coordinate, mm; 0 if the images agree with the file
    seat: tuple[Component, ...]  # of the seat by each kind of mode, mm
    drift: Component  # of the cone over the whole range of each drift mode, mm
    jitter: RandomEffect  # seating from image to image
    fields: tuple[FieldComponent, ...] = ()  # fitted ones

    @property
    def sigmas(self) -> list[float]:
        """Standard deviations by which the unknowns are fitted, mm."""
        found: list[Component | FieldComponent] = [self.leds, *self.seat]
        found += [self.drift, *self.fields]
        jitter = self.jitter.covariance
        by_axis = [] if jitter is None else np.sqrt(np.diag(jitter)).tolist()
        return [*(each.sigma for each in found), *by_axis]

    def with_no_fields(self, fields: tuple[ImageField, ...]) -> "Components":
        """Return these with the fields held at 0, or as stated."""
        return self._replace(fields=tuple(held(field) for field in fields))


NO_COMPONENTS = Components(
    NONE, (NONE,) * len(MODE_COUNTS), NONE, RandomEffect(None, 0.0)
)


class ParameterLayout(NamedTuple):
    """Indices of each kind of unknown; of the seat by kinds of modes."""

    tip: slice
    cone: slice
    cameras: tuple[slice, ...]
    extrinsics: slice
    fields: tuple[slice, ...]
    diameter: slice
    scale: slice
    leds: slice
    seat: tuple[slice, ...]
    drift: slice

    @property
    def of_files(self) -> tuple[slice, ...]:
        """Indices of what the same files state in any fit, the cameras apart."""
        own = {"tip", "cone", "cameras", "fields", "seat", "drift"}
        return tuple(getattr(self, name) for name in self._fields if name not in own)

    @property
    def whole_seat(self) -> slice:
        """Indices of all seat modes."""
        return slice(self.seat[0].start, self.seat[-1].stop)


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The unknowns of a fit as combinations of the columns of `NormalEquations`."""

    layout: ParameterLayout  # indices of each kind
    start: BundleState
    # (K, p0), columns of `NormalEquations` by the unknowns common to all images.
    mixing: FloatArray
    # (N, m), weights of the moves of the cone in each image: seat and drift modes.
    forms: FloatArray
    basis: FloatArray  # (3 L, 3 L - 6), moves of LEDs without moves of the whole pen
    scaling: FloatArray  # (3 L,), move of the LEDs about the tip by a scale of 1
    priors: Priors
    modes: SeatModes
    fields: tuple[ImageField, ...]  # the fitted ones
    noise: FloatArray  # (N, C, L), noise of each LED centre relative to a usual one

    @classmethod
    def of(
        cls,
        start: BundleState,
        priors: Priors,
        given: SeatModes,
        fields: tuple[ImageField, ...] = (),
        noise: FloatArray | None = None,
    ) -> "Unknowns":
        """Return the unknowns of a fit that starts there."""
        rig, pen = start.rig, start.pen
        n_leds = pen.n_leds
        sizes = [len(camera.intrinsics) for camera in rig.cameras]
        n_extrinsics = 6 * (rig.n_cameras - 1)
        basis = led_basis(pen.leds)
        end = 0

        def following(n: int) -> slice:
            nonlocal end
            end += n
            return slice(end - n, end)

        layout = ParameterLayout(
            tip=following(3),
            cone=following(3),
            cameras=tuple(map(following, sizes)),
            extrinsics=following(n_extrinsics),
            fields=tuple(following(field.number) for field in fields),
            diameter=following(1),
            scale=following(1),
            leds=following(basis.shape[1]),
            seat=tuple(following(3 * n_forms) for n_forms in MODE_COUNTS),
            drift=following(3 * given.drift.shape[1]),
        )
        scaling = (pen.leds - start.tip_pen).ravel()
        n_fields = sum(field.number for field in fields)
        K = N_CONE + sum(sizes) + n_extrinsics + n_fields + 1 + 3 * n_leds
        mixing = np.zeros((K, layout.leds.stop))
        at_leds = slice(K - 3 * n_leds, K)
        mixing[at_leds, layout.tip] = -np.tile(np.eye(3), (n_leds, 1))
        mixing[:N_CONE, layout.cone] = np.eye(3)
        row = N_CONE
        for c, at in enumerate(layout.cameras):
            mixing[row : row + sizes[c], at] = np.eye(sizes[c])
            row += sizes[c]
            if c > 0:
                place = layout.extrinsics.start + 6 * (c - 1)
                mixing[row : row + 6, place : place + 6] = np.eye(6)
                row += 6
        first = layout.diameter.start - n_fields
        mixing[row : row + n_fields, first : layout.diameter.start] = np.eye(n_fields)
        mixing[row + n_fields, layout.diameter] = 1.0
        mixing[at_leds, layout.scale.start] = scaling
        mixing[at_leds, layout.leds] = basis
        forms = np.column_stack([given.lean, given.drift])
        return cls(
            *(layout, start, mixing, forms, basis, scaling, priors),
            *(given, fields),
            np.broadcast_to(
                1.0 if noise is None else noise,
                (len(start.rotations), rig.n_cameras, n_leds),
            ),
        )

    def views_at(
        self, state: BundleState, pixels: FloatArray
    ) -> tuple[CameraView, ...]:
        """Linearise the images about a state, each LED in units of its noise."""
        views = views_at(state, pixels, self.field_columns)
        return tuple(view.in_units_of(self.noise[:, c]) for c, view in enumerate(views))

    @property
    def field_columns(self) -> FloatArray:
        """Columns of all fields, (N, C, L, 2, E)."""
        none = np.zeros((*self.noise.shape, 2, 0))
        return np.concatenate([none, *(each.columns for each in self.fields)], axis=-1)

    def effective(self, rotations: FloatArray) -> FloatArray:
        """Return the effective tip and cone by the unknowns, (6, p).

        Moves of the ball by seat and drift move them as in `effective_tip`; rotations
        (N, 3, 3) are rig_from_pen.
        """
        moves = np.einsum("nm,ij->nimj", self.forms, np.eye(N_CONE))
        effective = np.eye(6, self.number)
        effective[:, self.layout.seat[0].start :] = effective_tip(
            rotations, moves.reshape(len(rotations), N_CONE, -1)
        )
        return effective

    @property
    def number(self) -> int:
        """Number of unknowns, rotations apart."""
        return int(self.layout.drift.stop)

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
        """Return the prior information L with these components, (p, p)."""
        at, priors = self.layout, self.priors
        prior = self._of_files.copy()
        for place, sigma in (
            (at.leds, max(components.leds.sigma, priors.led_sigma or 0.0)),
            (at.drift, components.drift.sigma),
        ):
            n = place.stop - place.start
            prior[place, place] = np.eye(n) / max(sigma, EXACT) ** 2
        for place, found in zip(at.fields, components.fields, strict=True):
            prior[place, place] = known_by(found.covariance)
        prior[at.whole_seat, at.whole_seat] = np.diag(
            1 / self.seat_variances(components)
        )
        of_leds = priors.led_covariance
        if of_leds is not None and components.leds is NONE:  # the images agree with it
            known = self.basis.T @ of_leds @ self.basis
            prior[at.leds, at.leds] = inverse(known + EXACT**2 * np.eye(len(known)))
        return prior

    def prior_right(self) -> FloatArray:
        """Return the right side by the means of the priors, (p,).

        Only the scale has one: the thermal growth of the pen against its file.
        """
        right, at = np.zeros(self.number), self.layout.scale
        right[at] = self._of_files[at, at] @ [self.priors.growth]
        return right

    @cached_property
    def _of_files(self) -> FloatArray:
        """Prior information of all but LEDs, seat and drift, (p, p)."""
        at, priors = self.layout, self.priors
        prior = np.zeros((self.number, self.number))
        for place, each in zip(at.cameras, priors.cameras, strict=True):
            prior[place, place] = known_by(each.covariance)
        if priors.extrinsics is not None:
            prior[at.extrinsics, at.extrinsics] = known_by(priors.extrinsics.covariance)
        prior[at.diameter, at.diameter] = known_by(priors.diameter.covariance)
        prior[at.scale, at.scale] = known_by(priors.size_covariance)
        return prior

    def measured(self) -> tuple[FloatArray, FloatArray]:
        """Return information (p, p) and right side (p,) of the areas of the discs."""
        at, priors = self.layout, self.priors
        information = np.zeros((self.number, self.number))
        right = np.zeros(self.number)
        if priors.reading is not None:
            weight = priors.reading.sigma**-2
            change = priors.reading.value - self.start.pen.diameter
            information[at.diameter, at.diameter] = weight
            right[at.diameter] = weight * change
        return information, right

    def seat_variances(self, components: Components) -> FloatArray:
        """Return the variances of the moves in each seat mode, (21,)."""
        one_wave, *others = (each.sigma for each in components.seat)
        # One wave is hardly observable beside the tip, so it is taken to be as large
        # as the largest other mode.
        sigmas = np.array([max(one_wave, *others), *others])
        by_kind = np.maximum(sigmas, max(self.priors.form_error, EXACT)) ** 2
        return np.repeat(by_kind, N_CONE * np.array(MODE_COUNTS))

    def moved(
        self, now: BundleState, values: FloatArray, turns: FloatArray
    ) -> BundleState:
        """Return the state by new values and the turn of each image, (N, 3)."""
        at, start, rig = self.layout, self.start, self.start.rig
        cameras = tuple(
            camera.with_intrinsics(camera.intrinsics + values[place])
            for camera, place in zip(rig.cameras, at.cameras, strict=True)
        )
        places = np.concatenate([np.zeros(6), values[at.extrinsics]]).reshape(-1, 6)
        tip = now.tip_pen + values[at.tip]
        leds = start.pen.leds + (self.basis @ values[at.leds]).reshape(-1, 3)
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
                leds=leds + values[at.scale] * (leds - tip),
                diameter=start.pen.diameter + float(values[at.diameter][0]),
            ),
            tip_pen=tip,
            cone_rig=now.cone_rig + values[at.cone],
            rotations=rotation_from_vector(turns) @ now.rotations,
        )


def led_basis(leds: FloatArray) -> FloatArray:
    """Return a basis of LED moves without rigid moves and scale, (3 L, 3 L - 6)."""
    return np.asarray(np.linalg.qr(whole_moves(leds), mode="complete")[0][:, 6:])


# Joint estimation of all variance components.


ROUNDS = 3  # of finding each component beside the others


def find_components(
    unknowns: Unknowns, information: FloatArray, right: FloatArray, before: Components
) -> Components:
    """Estimate the components jointly, given those of the previous pass.

    ``information`` (p, p) and ``right`` (p,) are of images and measurements.
    """
    now = before
    for _ in range(ROUNDS):
        known, now = now, _found_once(unknowns, information, right, now)
        if now.sigmas == known.sigmas:  # converged
            break
    return now


def _found_once(
    unknowns: Unknowns, information: FloatArray, right: FloatArray, before: Components
) -> Components:
    at, prior = unknowns.layout, unknowns.prior_information(before)
    covariance = inverse(information + prior)
    by_priors = unknowns.prior_right()
    values = covariance @ (right + by_priors)

    def own(place: slice) -> tuple[FloatArray, FloatArray]:
        known = inverse(covariance[place, place])
        return known - prior[place, place], known @ values[place] - by_priors[place]

    def find(place: slice, stated: float = 0.0) -> Component:
        return find_component(*own(place), stated)

    return before._replace(
        leds=_found_leds(unknowns, find),
        seat=_found_seat(unknowns, *own(at.whole_seat), before),
        drift=_likely(find(at.drift)),
        fields=tuple(
            size_of(field, *own(place))
            for field, place in zip(unknowns.fields, at.fields, strict=True)
        ),
    )


def _found_seat(
    unknowns: Unknowns, information: FloatArray, right: FloatArray, before: Components
) -> tuple[Component, ...]:
    """Return the component of each kind of seat mode beside those of the others.

    ``information`` (21, 21) and ``right`` (21,) are of all modes, without any prior.
    """
    variances, form_error = unknowns.seat_variances(before), unknowns.priors.form_error
    first, seat = unknowns.layout.whole_seat.start, []
    for place in unknowns.layout.seat:
        some = slice(place.start - first, place.stop - first)
        others = variances.copy()
        others[some] = 0.0
        moves = np.eye(len(variances))[:, some]
        found = find_beside(information, right, moves, np.diag(others), form_error)
        seat.append(_likely(found, form_error))
    return tuple(seat)


def _found_leds(
    unknowns: Unknowns, find: Callable[[slice, float], Component]
) -> Component:
    stated, of_leds = unknowns.priors.led_sigma, unknowns.priors.led_covariance
    if of_leds is not None:  # by the least known direction
        stated = float(np.sqrt(np.linalg.eigvalsh(of_leds)[-1]))
    component = find(unknowns.layout.leds, stated or 0.0)
    if stated is None or (component.is_significant and component.sigma > stated):
        return component
    return NONE


def _likely(found: Component, stated: float = 0.0) -> Component:
    """Return a component if it is significant; else one of standard deviation 0."""
    if found.sigma > stated and found.exceeds(FITTED):
        return found
    return NONE._replace(expected_sigma=found.expected_sigma)
