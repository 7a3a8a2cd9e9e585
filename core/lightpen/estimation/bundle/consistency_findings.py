"""Contradictions between the images and the files of cameras, rig and pen.

Each contradicted number is reported with its estimate from the images while all
contradicted numbers are released from their priors.
"""

from dataclasses import dataclass, field, replace
from math import floor, log10

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.consistency_test import FileFit, FileNumber
from lightpen.estimation.bundle.priors import Prior, Priors
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, of_camera

VAGUE = 0.2  # of a value, U (k = 2): centres alone may give a negative diameter
RELEASED = 10.0  # standard deviation of a released prior, times the deviation found

FOCAL_LENGTH = message("file.focal-length")
ASPECT = message("file.aspect")
PRINCIPAL_POINT = (message("file.cx"), message("file.cy"))
DIAMETER = message("file.diameter")
SCALE = message("file.scale")
BASE = "file.rig-translation"
AS_SCALE = 0.1  # of a translation: a change that a wrong scale makes, too


@dataclass(frozen=True)
class Contradiction:
    """A number of a file that the images contradict."""

    what: Message  # name of the number
    unit: str
    # `stated` and `stated_uncertainty`: value in the file and its U (k = 2), ``unit``.
    stated: float
    stated_uncertainty: float
    # `estimated` and `estimated_uncertainty`: the same by the images alone.
    estimated: float
    estimated_uncertainty: float
    deviations: float  # their difference in standard deviations
    camera: str  # name of the camera concerned; empty for a single camera
    of_rig: bool  # whether the rig file states it, not a camera file
    of_pen: bool = False  # whether the LED file states it
    # Whether the file agrees with the images once they are turned by 180 degrees.
    is_turned: bool = False

    @property
    def is_vague(self) -> bool:
        """Whether the images hardly determine the number."""
        size = max(self.stated, self.estimated)
        return self.estimated_uncertainty > VAGUE * size

    @property
    def message(self) -> Message:
        """The message to the user."""
        wanted = _known_digits(self.estimated, self.estimated_uncertainty)
        if self.of_pen and self.of_rig:
            return message(
                "warning.scale-contradicted",
                wanted=wanted,
                wanted_u=self.estimated_uncertainty,
                stated_u=self.stated_uncertainty,
            )
        numbers = message(
            "warning.contradicted-numbers",
            what=self.what,
            wanted=wanted,
            wanted_u=self.estimated_uncertainty,
            stated=self.stated,
            stated_u=self.stated_uncertainty,
            unit=f" {self.unit}" if self.unit else "",
        )
        if self.of_pen:
            return message("warning.pen-file-contradicted", numbers=numbers)
        camera, change = self.camera, abs(self.estimated - self.stated)
        if self.is_turned:
            turned = message("warning.images-turned")
            return of_camera(camera, turned) if camera else turned
        if not self.of_rig:
            found = message("warning.camera-file-contradicted", numbers=numbers)
            return of_camera(camera, found) if camera else found
        if self.what.code == BASE and change < AS_SCALE * abs(self.stated):
            return message("warning.base-contradicted", camera=camera, numbers=numbers)
        return message("warning.rig-file-contradicted", camera=camera, numbers=numbers)


@dataclass(frozen=True, eq=False)
class ContradictedInputs:
    """The contradicted numbers of the files of cameras and rig."""

    priors: Priors  # priors with the contradicted numbers released
    # Indices of the numbers by index of the file; the rig's file is the last.
    numbers: dict[int, tuple[int, ...]] = field(default_factory=dict)


def find_contradicted_inputs(
    rig: Rig,
    bundle: Bundle,
    priors: Priors,
    excess: FloatArray | None,
    before: ContradictedInputs,
) -> ContradictedInputs:
    """Find the numbers of the files of cameras and rig that the images contradict.

    Files are added one at a time, the most contradicted first, as it may be what moves
    the others. It is ``before``, with whose priors the bundle was fitted, if no other
    is contradicted. ``excess`` (p, p) as in
    `lightpen.estimation.bundle.noise_correlation.Correlation`.
    """
    fits = _fits(rig, bundle, priors, excess)
    numbers = {f: fits[f].contradicted for f in before.numbers if fits[f].contradicted}
    if numbers == before.numbers:
        others = [
            f for f in range(len(fits)) if f not in numbers and fits[f].contradicted
        ]
        if not others:
            return before
        worst = max(others, key=lambda f: fits[f].max_deviation)
        numbers = {**numbers, worst: fits[worst].contradicted}
    cameras, extrinsics = list(priors.cameras), priors.extrinsics
    for f, released in numbers.items():
        if f < rig.n_cameras:
            cameras[f] = _without(cameras[f], fits[f], released)
        elif extrinsics is not None:
            extrinsics = _without(extrinsics, fits[f], released)
    released_priors = replace(priors, cameras=tuple(cameras), extrinsics=extrinsics)
    return ContradictedInputs(released_priors, numbers)


def contradictions_of(
    rig: Rig,
    bundle: Bundle,
    priors: Priors,
    excess: FloatArray | None,
    inputs: ContradictedInputs,
) -> tuple[Contradiction, ...]:
    """Return the contradictions of the files of cameras and rig, the worst first.

    ``excess`` as in `find_contradicted_inputs`; the bundle is fitted with the priors of
    ``inputs``.
    """
    if not inputs.numbers:
        return ()
    fits = _fits(rig, bundle, priors, excess)
    found = []
    for f, released in inputs.numbers.items():
        name = rig.names[f] if f < rig.n_cameras and rig.names else ""
        of_file = _contradictions(fits[f], released)
        is_camera = f < rig.n_cameras
        if is_camera and _are_turned(
            of_file, rig.cameras[f], bundle.state.rig.cameras[f]
        ):
            of_file = [replace(each, is_turned=True) for each in of_file]
        found += [replace(each, camera=name) for each in of_file] if name else of_file
    return tuple(sorted(found, key=lambda each: -each.deviations))


def find_pen_contradictions(
    pen: Pen, bundle: Bundle, priors: Priors, excess: FloatArray | None = None
) -> tuple[tuple[Contradiction, ...], Priors]:
    """Return contradictions of disc diameter and scale in the LED file ``pen``.

    And the priors, without the contradicted numbers.
    """
    at, one = bundle.layout, np.ones(1)

    def tested(
        statement: FileNumber,
        place: slice,
        stated: FloatArray,
        prior: Prior,
        mean: float = 0.0,
    ) -> tuple[list[Contradiction], Prior]:
        fit = FileFit.of([statement], stated, bundle, place, excess, mean)
        found = _contradictions(fit, fit.contradicted)
        if any(each.is_vague for each in found):
            return [], prior
        return found, _without(prior, fit, fit.contradicted)

    discs, diameter = tested(
        FileNumber(DIAMETER, "mm", pen.diameter, one, one),
        at.diameter,
        priors.diameter.covariance,
        priors.diameter,
    )
    size, scale = tested(
        FileNumber(SCALE, "", 1.0, one, one),
        at.scale,
        priors.size_covariance,
        priors.scale,
        priors.growth,
    )
    is_rig = bundle.state.rig.n_cameras > 1
    size = [replace(each, of_rig=is_rig) for each in size]
    found = tuple(replace(each, of_pen=True) for each in (*discs, *size))
    return found, replace(priors, diameter=diameter, scale=scale)


def _fits(
    rig: Rig, bundle: Bundle, priors: Priors, excess: FloatArray | None
) -> list[FileFit]:
    """Return prior and likelihood of each camera's file, and last of the rig's."""
    layout = bundle.layout
    fits = [
        FileFit.of(_of_camera(*both), prior.covariance, bundle, place, excess)
        for *both, prior, place in zip(
            rig.cameras,
            bundle.state.rig.cameras,
            priors.cameras,
            layout.cameras,
            strict=True,
        )
    ]
    if priors.extrinsics is not None:
        stated, place = priors.extrinsics.covariance, layout.extrinsics
        fits.append(FileFit.of(_places(rig), stated, bundle, place, excess))
    return fits


def _contradictions(fit: FileFit, released: tuple[int, ...]) -> list[Contradiction]:
    """Return the released numbers of a file as contradictions, in their units."""
    found = []
    for i in released:
        each, estimate = fit.numbers[i], fit.estimate_without(i, released)
        found.append(
            Contradiction(
                what=each.what,
                unit=each.unit,
                stated=each.value,
                stated_uncertainty=2 * each.size * estimate.stated_sigma,
                estimated=each.value + each.size * estimate.change,
                estimated_uncertainty=2 * each.size * estimate.sigma,
                deviations=estimate.deviations,
                camera=each.camera,
                of_rig=bool(each.camera),
            )
        )
    return found


def _are_turned(found: list[Contradiction], stated: Camera, fitted: Camera) -> bool:
    """Return whether a half turn of the images explains contradicted coordinates."""
    file, images = stated.intrinsics[2:4], fitted.intrinsics[2:4]
    turned = np.array(stated.image_size) - 1 - file
    if np.any(np.abs(images - turned) > np.abs(images - file)):
        return False
    wanted = dict(zip((each.code for each in PRINCIPAL_POINT), turned, strict=True))
    of_point = [each for each in found if each.what.code in wanted]
    return bool(of_point) and all(
        abs(wanted[each.what.code] - each.estimated) < each.estimated_uncertainty
        for each in of_point
    )


def _without(prior: Prior, fit: FileFit, released: tuple[int, ...]) -> Prior:
    """Return a prior with numbers released."""
    covariance = prior.covariance
    for i in released:
        along, change = fit.numbers[i].along, fit.estimate_without(i, released).change
        covariance = covariance + (RELEASED * change) ** 2 * np.outer(along, along)
    return replace(prior, covariance=covariance)


def _known_digits(value: float, uncertainty: float) -> float:
    """Return a value down to the second digit of its uncertainty."""
    return round(value, 1 - floor(log10(uncertainty)))


def _places(rig: Rig) -> list[FileNumber]:
    """Return the numbers of the rig's file, of all cameras but the first."""
    n = 6 * (rig.n_cameras - 1)
    unit = np.eye(n)
    numbers = []
    for c in range(1, rig.n_cameras):
        for k, axis in enumerate("xyz"):
            row = 6 * (c - 1) + k
            turn, shift = unit[row], unit[row + 3]
            numbers += [
                FileNumber(
                    message("file.rig-turn", axis=axis),
                    "deg",
                    0.0,
                    turn,
                    turn,
                    size=float(np.degrees(1.0)),
                    camera=rig.names[c],
                ),
                FileNumber(
                    message("file.rig-translation", axis=axis),
                    "mm",
                    float(rig.translations[c, k]),
                    shift,
                    shift,
                    camera=rig.names[c],
                ),
            ]
    return numbers


def _of_camera(camera: Camera, fitted: Camera) -> list[FileNumber]:
    """Return the numbers of a camera's file."""
    n = len(camera.intrinsics)
    unit = np.eye(n)
    focal = 0.5 * (camera.fx + camera.fy)
    along = (camera.fx * unit[0] + camera.fy * unit[1]) / focal
    ratio = camera.fy / camera.fx
    numbers = [
        FileNumber(FOCAL_LENGTH, "px", focal, 0.5 * (unit[0] + unit[1]), along),
        FileNumber(
            ASPECT,
            "",
            ratio,
            (unit[1] - ratio * unit[0]) / fitted.fx,  # exact, as it is a quotient
            0.5 * fitted.fx * (unit[1] - unit[0]),
        ),
    ]
    numbers += [
        FileNumber(what, "px", float(camera.intrinsics[k]), unit[k], unit[k])
        for k, what in zip((2, 3), PRINCIPAL_POINT, strict=True)
    ]
    numbers += [
        FileNumber(
            message("file.distortion", name=camera.distortion_names[k]),
            "",
            float(camera.distortion[k]),
            unit[4 + k],
            unit[4 + k],
        )
        for k in range(n - 4)
    ]
    return numbers
