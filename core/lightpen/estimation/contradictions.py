"""What the images say against the files of camera and pen.

A prior is contradicted where what was fitted lies farther from the file than both the
file's uncertainty and that of the images explain: the deviation of a posterior mean
from a prior mean has the covariance of the prior less that of the posterior.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle import Bundle
from lightpen.estimation.priors import Prior, Priors
from lightpen.estimation.unknowns import inverse
from lightpen.model.camera import Camera
from lightpen.model.rig import Rig
from lightpen.sentences import Sentence, sentence

LIMIT = 3.0  # standard deviations
RELEASED = 10.0  # times the deviation: what a contradicted prior still says

FOCAL_LENGTH = sentence("file.focal-length", "focal length")
ASPECT = sentence("file.aspect", "ratio fy / fx of the focal lengths")
PRINCIPAL_POINT = (
    sentence("file.cx", "principal point cx"),
    sentence("file.cy", "principal point cy"),
)
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
    """

    what: Sentence
    unit: str
    stated: float
    stated_uncertainty: float
    wanted: float
    wanted_uncertainty: float
    deviations: float

    @property
    def sentence(self) -> Sentence:
        """It in words, with what to do."""
        return sentence(
            "warning.camera-file-contradicted",
            "The images contradict the camera file: they want the {what} to be "
            "{wanted:.6g} \u00b1 {wanted_u:.2g}{unit}, the file says {stated:.6g} "
            "\u00b1 {stated_u:.2g}{unit}. Check that the file is of this camera, lens "
            "and focus, or calibrate the camera again.",
            what=self.what,
            wanted=self.wanted,
            wanted_u=self.wanted_uncertainty,
            stated=self.stated,
            stated_u=self.stated_uncertainty,
            unit=f" {self.unit}" if self.unit else "",
        )


@dataclass(frozen=True, eq=False)
class _Entry:
    """A combination of intrinsics that people know by a name.

    ``by`` takes it from intrinsics, ``along`` moves them by one unit of it; (n,) each.
    """

    what: Sentence
    unit: str
    value: float
    by: FloatArray
    along: FloatArray


def find_contradictions(
    rig: Rig, bundle: Bundle, priors: Priors
) -> tuple[tuple[Contradiction, ...], Priors]:
    """Find what the images say against the intrinsics of each camera.

    Returns
    -------
    contradictions : tuple of Contradiction
        By the fit as it is.
    priors : Priors
        Without what was contradicted.
    """
    found: list[Contradiction] = []
    cameras = list(priors.cameras)
    for c, (camera, place) in enumerate(
        zip(rig.cameras, bundle.columns.cameras, strict=True)
    ):
        # As it was fitted with: what a file has as exact is let be off by rounding.
        prior = inverse(bundle.prior_information[place, place])
        posterior = bundle.covariance[place, place]
        for entry in _entries(camera):
            before = float(entry.by @ prior @ entry.by)
            after = float(entry.by @ posterior @ entry.by)
            learned = before - after
            if learned <= 1e-6 * before:
                continue
            change = float(entry.by @ bundle.values[place])
            deviations = abs(change) / np.sqrt(learned)
            if deviations <= LIMIT:
                continue
            own = before * after / learned  # variance by the images alone
            wanted = entry.value + change * before / learned
            found.append(
                Contradiction(
                    what=entry.what,
                    unit=entry.unit,
                    stated=entry.value,
                    stated_uncertainty=2 * float(np.sqrt(before)),
                    wanted=wanted,
                    wanted_uncertainty=2 * float(np.sqrt(own)),
                    deviations=float(deviations),
                )
            )
            freed = (RELEASED * (wanted - entry.value)) ** 2
            freed_covariance = freed * np.outer(entry.along, entry.along)
            cameras[c] = Prior(
                cameras[c].covariance + freed_covariance, cameras[c].assumed
            )
    return tuple(found), replace(priors, cameras=tuple(cameras))


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
