"""What the images say against the files of camera and pen.

A prior is contradicted where what was fitted lies farther from the file than both the
file's uncertainty and that of the images explain: the deviation of a posterior mean
from a prior mean has the covariance of the prior less that of the posterior.
"""

from dataclasses import dataclass, replace
from math import floor, log10

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle import Bundle
from lightpen.estimation.priors import Prior, Priors
from lightpen.estimation.unknowns import inverse
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig
from lightpen.sentences import Sentence, sentence

LIMIT = 3.0  # standard deviations
VAGUE = 0.2  # of a value, U (k = 2): centres alone may want a negative diameter
ROUNDING = 1e-6  # of a variance
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
class _Entry:
    """A combination of unknowns that people know by a name.

    ``by`` takes it from the unknowns, ``along`` moves them by one of it, (n,) each;
    ``size`` is what that is in its unit.
    """

    what: Sentence
    unit: str
    value: float
    by: FloatArray
    along: FloatArray
    size: float = 1.0
    camera: str = ""  # of the rig, if its file says so


def find_contradictions(
    rig: Rig, bundle: Bundle, priors: Priors, excess: FloatArray | None = None
) -> tuple[tuple[Contradiction, ...], Priors]:
    """Find what the images say against the file of a camera, or of the rig.

    Of several files that are contradicted it is the one that is so most, and of a rig's
    the one number: it may be what moves the others.

    Parameters
    ----------
    excess : (p, p) array, optional
        By what the covariance of the fitted values is larger than the fit has it, as
        noise lasts.

    Returns
    -------
    contradictions : tuple of Contradiction
        By the fit as it is, the worst first.
    priors : Priors
        Without what was contradicted.
    """
    files = [_of_camera(rig, c, bundle, priors, excess) for c in range(rig.n_cameras)]
    if priors.extrinsics is not None:
        place, stated = bundle.columns.extrinsics, priors.extrinsics
        each = [
            _denied([entry], bundle, place, stated, excess) for entry in _places(rig)
        ]
        denied, extrinsics = max(each, key=_most)
        files.append((denied, replace(priors, extrinsics=extrinsics)))
    found, freed = max(files, key=_most)
    return tuple(sorted(found, key=lambda each: -each.deviations)), freed


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
        entry: _Entry, place: slice, stated: Prior
    ) -> tuple[list[Contradiction], Prior]:
        found, freed = _denied([entry], bundle, place, stated, excess)
        if any(each.wanted_uncertainty > VAGUE * each.stated for each in found):
            return [], stated
        return found, freed

    discs, diameter = denied(
        _Entry(DIAMETER, "mm", pen.diameter, one, one), at.diameter, priors.diameter
    )
    size, scale = denied(_Entry(SCALE, "", 1.0, one, one), at.scale, priors.scale)
    found = tuple(replace(each, of_pen=True) for each in (*discs, *size))
    return found, replace(priors, diameter=diameter, scale=scale)


def _most(denied: tuple[list[Contradiction], object]) -> float:
    """Return by how many standard deviations something is contradicted at most."""
    return max((each.deviations for each in denied[0]), default=0.0)


def _of_camera(
    rig: Rig, c: int, bundle: Bundle, priors: Priors, excess: FloatArray | None
) -> tuple[list[Contradiction], Priors]:
    """Return what is contradicted of a camera's file, and the priors without it."""
    place, cameras = bundle.columns.cameras[c], list(priors.cameras)
    denied, cameras[c] = _denied(
        _entries(rig.cameras[c]), bundle, place, cameras[c], excess
    )
    name = rig.names[c] if rig.names else ""
    named = [replace(each, camera=name) for each in denied]
    return named, replace(priors, cameras=tuple(cameras))


def _known_digits(value: float, uncertainty: float) -> float:
    """Return a value down to the second digit of its uncertainty."""
    return round(value, 1 - floor(log10(uncertainty)))


def _denied(
    entries: list[_Entry],
    bundle: Bundle,
    place: slice,
    stated: Prior,
    excess: FloatArray | None,
) -> tuple[list[Contradiction], Prior]:
    """Return what is contradicted of unknowns, and their prior that lets go of it."""
    # As it was fitted with: what a file has as exact is let be off by rounding.
    prior = inverse(bundle.prior_information[place, place])
    posterior = bundle.covariance[place, place]
    lasting = np.zeros_like(posterior) if excess is None else excess[place, place]
    found = []
    for entry in entries:
        before = float(entry.by @ prior @ entry.by)
        after = float(entry.by @ posterior @ entry.by)
        learned = before - after
        if learned <= ROUNDING * before:
            continue
        change = float(entry.by @ bundle.values[place])
        by_noise = float(entry.by @ lasting @ entry.by)
        deviations = abs(change) / np.sqrt(max(learned + by_noise, ROUNDING * before))
        if deviations <= LIMIT:
            continue
        # Variance by the images alone.
        gain = learned / before
        own = max((after + by_noise / gain) / gain, ROUNDING * before)
        wanted = entry.value + entry.size * change * before / learned
        found.append(
            Contradiction(
                what=entry.what,
                unit=entry.unit,
                stated=entry.value,
                stated_uncertainty=2 * entry.size * float(np.sqrt(before)),
                wanted=wanted,
                wanted_uncertainty=2 * entry.size * float(np.sqrt(own)),
                deviations=float(deviations),
                camera=entry.camera,
                of_rig=bool(entry.camera),
            )
        )
        freed = (RELEASED * (wanted - entry.value) / entry.size) ** 2
        freed_covariance = freed * np.outer(entry.along, entry.along)
        stated = replace(stated, covariance=stated.covariance + freed_covariance)
    return found, stated


def _places(rig: Rig) -> list[_Entry]:
    """Return what the rig's file says of all cameras but the first."""
    n = 6 * (rig.n_cameras - 1)
    unit = np.eye(n)
    entries = []
    for c in range(1, rig.n_cameras):
        for k, axis in enumerate("xyz"):
            row = 6 * (c - 1) + k
            turn, shift = unit[row], unit[row + 3]
            entries += [
                _Entry(
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
                _Entry(
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
    return entries


def _entries(camera: Camera) -> list[_Entry]:
    n = len(camera.intrinsics)
    unit = np.eye(n)
    focal = 0.5 * (camera.fx + camera.fy)
    along = (camera.fx * unit[0] + camera.fy * unit[1]) / focal
    ratio = camera.fy / camera.fx
    entries = [
        _Entry(FOCAL_LENGTH, "px", focal, 0.5 * (unit[0] + unit[1]), along),
        _Entry(
            ASPECT,
            "",
            ratio,
            (unit[1] - ratio * unit[0]) / camera.fx,
            0.5 * camera.fx * (unit[1] - unit[0]),
        ),
    ]
    entries += [
        _Entry(what, "px", float(camera.intrinsics[k]), unit[k], unit[k])
        for k, what in zip((2, 3), PRINCIPAL_POINT, strict=True)
    ]
    entries += [
        _Entry(
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
    return entries
