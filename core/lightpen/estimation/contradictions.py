"""What the images say against the files of camera and pen.

What is contradicted of a file is told with what the images want of it where all else
that is contradicted is let go as well.
"""

from dataclasses import dataclass, field, replace
from math import floor, log10

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle import Bundle
from lightpen.estimation.priors import Prior, Priors
from lightpen.estimation.refutation import FileFit, FileNumber
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig
from lightpen.sentences import Sentence, sentence

VAGUE = 0.2  # of a value, U (k = 2): centres alone may want a negative diameter
RELEASED = 10.0  # times the deviation: what a contradicted prior still says

FOCAL_LENGTH = sentence("file.focal-length", "focal length")
ASPECT = sentence("file.aspect", "ratio fy / fx of the focal lengths")
PRINCIPAL_POINT = (
    sentence("file.cx", "principal point cx"),
    sentence("file.cy", "principal point cy"),
)
DIAMETER = sentence("file.diameter", "diameter of the discs")
SCALE = sentence("file.scale", "scale of the LEDs")
COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")


@dataclass(frozen=True)
class Contradiction:
    """One thing that a file says and the images deny.

    Attributes
    ----------
    what : Sentence
        Name of it.
    stated, stated_uncertainty : float
        What the file says; U (k = 2), in ``unit``.
    wanted, wanted_uncertainty : float
        What the images say without it, likewise.
    deviations : float
        How many standard deviations lie between them.
    camera : str
        Of a rig, which the file is about; empty of a camera alone.
    of_rig : bool
        Whether it is the rig's file that says so, and not the camera's.
    of_pen : bool
        Whether it is the LED file.
    """

    what: Sentence
    unit: str
    stated: float
    stated_uncertainty: float
    wanted: float
    wanted_uncertainty: float
    deviations: float
    camera: str = ""
    of_rig: bool = False
    of_pen: bool = False

    @property
    def sentence(self) -> Sentence:
        """It in words, with what to do."""
        unit = f" {self.unit}" if self.unit else ""
        wanted = _known_digits(self.wanted, self.wanted_uncertainty)
        if self.of_pen:
            return sentence(
                "warning.pen-file-contradicted",
                "The images contradict the LED file: they want the {what} to be "
                "{wanted:.6g} \u00b1 {wanted_u:.2g}{unit}, the file says {stated:.6g} "
                "\u00b1 {stated_u:.2g}{unit}. Check that the file is of this pen, or "
                "measure the pen again.",
                what=self.what,
                wanted=wanted,
                wanted_u=self.wanted_uncertainty,
                stated=self.stated,
                stated_u=self.stated_uncertainty,
                unit=unit,
            )
        if not self.camera:
            return sentence(
                "warning.camera-file-contradicted",
                "The images contradict the camera file: they want the {what} to be "
                "{wanted:.6g} \u00b1 {wanted_u:.2g}{unit}, the file says {stated:.6g} "
                "\u00b1 {stated_u:.2g}{unit}. Check that the file is of this camera, "
                "lens and focus, or calibrate the camera again.",
                what=self.what,
                wanted=wanted,
                wanted_u=self.wanted_uncertainty,
                stated=self.stated,
                stated_u=self.stated_uncertainty,
                unit=unit,
            )
        if not self.of_rig:
            return sentence(
                "warning.camera-file-of-rig-contradicted",
                "The images contradict the file of camera {camera}: they want the "
                "{what} to be {wanted:.6g} \u00b1 {wanted_u:.2g}{unit}, the file says "
                "{stated:.6g} \u00b1 {stated_u:.2g}{unit}. Check that the file is of "
                "this camera, lens and focus, or calibrate the camera again.",
                camera=self.camera,
                what=self.what,
                wanted=wanted,
                wanted_u=self.wanted_uncertainty,
                stated=self.stated,
                stated_u=self.stated_uncertainty,
                unit=unit,
            )
        return sentence(
            "warning.rig-file-contradicted",
            "The images contradict the rig file: of camera {camera} they want the "
            "{what} to be {wanted:.6g} \u00b1 {wanted_u:.2g}{unit}, the file says "
            "{stated:.6g} \u00b1 {stated_u:.2g}{unit}. Check that no camera was moved "
            "since, or calibrate the rig again.",
            camera=self.camera,
            what=self.what,
            wanted=wanted,
            wanted_u=self.wanted_uncertainty,
            stated=self.stated,
            stated_u=self.stated_uncertainty,
            unit=unit,
        )


@dataclass(frozen=True, eq=False)
class Denied:
    """What is contradicted of the files of cameras and rig.

    Attributes
    ----------
    numbers : dict of tuple of int
        Of the statements of each file that has some; the rig's is the last.
    priors : Priors
        Without them.
    """

    priors: Priors
    numbers: dict[int, tuple[int, ...]] = field(default_factory=dict)


def deny(
    rig: Rig,
    bundle: Bundle,
    priors: Priors,
    excess: FloatArray | None,
    before: Denied,
) -> Denied:
    """Return what the images say against the files of the cameras, or of the rig.

    Of several files it is the one that is contradicted most, and one more each time:
    it may be what moves the others.

    Parameters
    ----------
    bundle : Bundle
        Fitted without what was contradicted before.
    priors : Priors
        As stated.
    excess : (p, p) array or None
        By what the covariance of the fitted values is larger than the fit has it, as
        noise lasts.

    Returns
    -------
    Denied
        With the same numbers as before, if nothing else is contradicted.
    """
    fits = _fits(rig, bundle, priors, excess)
    numbers = {f: fits[f].refuted for f in before.numbers if fits[f].refuted}
    if numbers == before.numbers:
        others = [f for f in range(len(fits)) if f not in numbers and fits[f].refuted]
        if not others:
            return before
        worst = max(others, key=lambda f: fits[f].most)
        numbers = {**numbers, worst: fits[worst].refuted}
    cameras, extrinsics = list(priors.cameras), priors.extrinsics
    for f, let_go in numbers.items():
        if f < rig.n_cameras:
            cameras[f] = _without(cameras[f], fits[f], let_go)
        elif extrinsics is not None:
            extrinsics = _without(extrinsics, fits[f], let_go)
    freed = replace(priors, cameras=tuple(cameras), extrinsics=extrinsics)
    return Denied(freed, numbers)


def contradictions_of(
    rig: Rig,
    bundle: Bundle,
    priors: Priors,
    excess: FloatArray | None,
    denied: Denied,
) -> tuple[Contradiction, ...]:
    """Return what is denied of the files of cameras and rig, the worst first.

    The parameters are as of `deny`; the bundle is the one without all that is denied.
    """
    if not denied.numbers:
        return ()
    fits = _fits(rig, bundle, priors, excess)
    found = []
    for f, let_go in denied.numbers.items():
        name = rig.names[f] if f < rig.n_cameras and rig.names else ""
        of_file = _contradictions(fits[f], let_go)
        found += [replace(each, camera=name) for each in of_file] if name else of_file
    return tuple(sorted(found, key=lambda each: -each.deviations))


def find_pen_contradictions(
    pen: Pen, bundle: Bundle, priors: Priors, excess: FloatArray | None = None
) -> tuple[tuple[Contradiction, ...], Priors]:
    """Find what the images say against the discs and the scale of the LED file.

    Parameters
    ----------
    pen : Pen
        As its file has it.

    Returns
    -------
    contradictions : tuple of Contradiction
        By the fit as it is.
    priors : Priors
        Without what was contradicted.
    """
    at, one = bundle.columns, np.ones(1)

    def denied(
        statement: FileNumber, place: slice, stated: FloatArray, prior: Prior
    ) -> tuple[list[Contradiction], Prior]:
        fit = FileFit.of([statement], stated, bundle, place, excess)
        found = _contradictions(fit, fit.refuted)
        if any(each.wanted_uncertainty > VAGUE * each.stated for each in found):
            return [], prior
        return found, _without(prior, fit, fit.refuted)

    discs, diameter = denied(
        FileNumber(DIAMETER, "mm", pen.diameter, one, one),
        at.diameter,
        priors.diameter.covariance,
        priors.diameter,
    )
    size, scale = denied(
        FileNumber(SCALE, "", 1.0, one, one),
        at.scale,
        priors.size_covariance,
        priors.scale,
    )
    found = tuple(replace(each, of_pen=True) for each in (*discs, *size))
    return found, replace(priors, diameter=diameter, scale=scale)


def _fits(
    rig: Rig, bundle: Bundle, priors: Priors, excess: FloatArray | None
) -> list[FileFit]:
    """Return what the images say of each camera's file, and last of the rig's."""
    columns = bundle.columns
    fits = [
        FileFit.of(_of_camera(*both), prior.covariance, bundle, place, excess)
        for *both, prior, place in zip(
            *(rig.cameras, bundle.state.rig.cameras, priors.cameras, columns.cameras),
            strict=True,
        )
    ]
    if priors.extrinsics is not None:
        stated, place = priors.extrinsics.covariance, columns.extrinsics
        fits.append(FileFit.of(_places(rig), stated, bundle, place, excess))
    return fits


def _contradictions(fit: FileFit, let_go: tuple[int, ...]) -> list[Contradiction]:
    """Return in people's units what is contradicted of a file."""
    found = []
    for i in let_go:
        each, wanted = fit.statements[i], fit.wanted(i, let_go)
        found.append(
            Contradiction(
                what=each.what,
                unit=each.unit,
                stated=each.value,
                stated_uncertainty=2 * each.size * wanted.stated_sigma,
                wanted=each.value + each.size * wanted.change,
                wanted_uncertainty=2 * each.size * wanted.sigma,
                deviations=wanted.deviations,
                camera=each.camera,
                of_rig=bool(each.camera),
            )
        )
    return found


def _without(prior: Prior, fit: FileFit, let_go: tuple[int, ...]) -> Prior:
    """Return a prior that lets go of numbers."""
    covariance = prior.covariance
    for i in let_go:
        along, change = fit.statements[i].along, fit.wanted(i, let_go).change
        covariance = covariance + (RELEASED * change) ** 2 * np.outer(along, along)
    return replace(prior, covariance=covariance)


def _known_digits(value: float, uncertainty: float) -> float:
    """Return a value down to the second digit of its uncertainty."""
    return round(value, 1 - floor(log10(uncertainty)))


def _places(rig: Rig) -> list[FileNumber]:
    """Return what the rig's file says of all cameras but the first."""
    n = 6 * (rig.n_cameras - 1)
    unit = np.eye(n)
    statements = []
    for c in range(1, rig.n_cameras):
        for k, axis in enumerate("xyz"):
            row = 6 * (c - 1) + k
            turn, shift = unit[row], unit[row + 3]
            statements += [
                FileNumber(
                    sentence(
                        "file.rig-turn",
                        "further turn of cam_from_rig about {axis}",
                        axis=axis,
                    ),
                    "deg",
                    0.0,
                    turn,
                    turn,
                    size=float(np.degrees(1.0)),
                    camera=rig.names[c],
                ),
                FileNumber(
                    sentence(
                        "file.rig-translation",
                        "translation of cam_from_rig along {axis}",
                        axis=axis,
                    ),
                    "mm",
                    float(rig.translations[c, k]),
                    shift,
                    shift,
                    camera=rig.names[c],
                ),
            ]
    return statements


def _of_camera(camera: Camera, fitted: Camera) -> list[FileNumber]:
    """Return what a camera's file says of the camera that was fitted."""
    n = len(camera.intrinsics)
    unit = np.eye(n)
    focal = 0.5 * (camera.fx + camera.fy)
    along = (camera.fx * unit[0] + camera.fy * unit[1]) / focal
    ratio = camera.fy / camera.fx
    statements = [
        FileNumber(FOCAL_LENGTH, "px", focal, 0.5 * (unit[0] + unit[1]), along),
        FileNumber(
            ASPECT,
            "",
            ratio,
            (unit[1] - ratio * unit[0]) / fitted.fx,  # exact, as it is a quotient
            0.5 * fitted.fx * (unit[1] - unit[0]),
        ),
    ]
    statements += [
        FileNumber(what, "px", float(camera.intrinsics[k]), unit[k], unit[k])
        for k, what in zip((2, 3), PRINCIPAL_POINT, strict=True)
    ]
    statements += [
        FileNumber(
            sentence(
                "file.distortion",
                "distortion coefficient {name}",
                name=COEFFICIENTS[k],
            ),
            "",
            float(camera.distortion[k]),
            unit[4 + k],
            unit[4 + k],
        )
        for k in range(n - 4)
    ]
    return statements
