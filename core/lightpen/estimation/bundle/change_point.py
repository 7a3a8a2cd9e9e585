"""A step in the middle of a swing: the tip turned in the pen, or cone or camera moved.

From image k on the tip lies elsewhere in the pen, or the cone elsewhere before the
camera. Either is a shift of the resting tip in each later image, so its likelihood at
every image follows from the normal equations of one fit, without drift and seat,
which would absorb a part of it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.pose import Poses
from lightpen.estimation.bundle.bundle import Bundle, solved_at_rest
from lightpen.estimation.bundle.linearised import N_CONE
from lightpen.estimation.pivot.pivot import contact_matrix, tip_covariances
from lightpen.messages import Message, message

MIN_PART = 6  # images on either side
# Twice the difference of the log-likelihoods. By chance alone one step among all images
# and both kinds reaches 30 in fewer than one of a hundred swings.
CERTAIN = 30.0
MORE_THAN_DRIFT = 10.0  # beyond what a linear drift gains
EXPLAINED = 0.8  # of the images, by a large step: those before it or after it slipped
# Most of the square of its distance that an image at the other place is beside it: by
# chance, and by what errors of the files add to a large step.
BY_CHANCE, BY_FILES = 16.0, 0.1


@dataclass(frozen=True, eq=False)
class ChangePoint:
    """A step between two images."""

    first: int  # index of the first image after it
    shift: FloatArray  # (3,), of the tip, pen frame, or of the cone, rig frame, mm
    is_tip: bool  # else cone or camera
    gain: float  # twice the gain of the log-likelihood

    @property
    def size(self) -> float:
        """Length of the shift, mm."""
        return float(np.linalg.norm(self.shift))

    def longer_part(self, n_images: int) -> tuple[int, int]:
        """Return the numbers of the first and last image of the longer part."""
        if 2 * self.first >= n_images:
            return 1, self.first
        return self.first + 1, n_images

    def told(self, n_images: int) -> Message:
        """Return what moved, when and by how much, and the part to be used."""
        begin, end = self.longer_part(n_images)
        kind = message("step.tip") if self.is_tip else message("step.cone")
        return message(
            "verdict.step",
            kind=kind,
            size=self.size,
            image=self.first + 1,
            begin=begin,
            end=end,
        )


class _Images(NamedTuple):
    """Score of a shift of the resting tip in each image, and what it is known by."""

    score: FloatArray  # (N, 3)
    information: FloatArray  # (N, 3, 3)
    coupling: FloatArray  # (N, 3, p), with the unknowns of all images
    covariance: FloatArray  # (p, p), of these

    def turned(self, R: FloatArray) -> "_Images":
        """Return the same for shifts in frames turned by R (N, 3, 3)."""
        transposed = np.swapaxes(R, 1, 2)
        return _Images(
            (transposed @ self.score[..., None])[..., 0],
            transposed @ self.information @ R,
            transposed @ self.coupling,
            self.covariance,
        )

    def gains(
        self, score: FloatArray, information: FloatArray, coupling: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return gain (K,) and shift (K, 3) of K shifts shared by images."""
        known = information - coupling @ self.covariance @ np.swapaxes(coupling, 1, 2)
        shifts = np.linalg.solve(known, score[..., None])[..., 0]
        gains: FloatArray = np.einsum("ki,ki->k", score, shifts)
        return gains, np.asarray(shifts, dtype=float)

    def steps(self) -> tuple[FloatArray, FloatArray]:
        """Return gain and shift of a step before each image but the first ones."""
        since = (np.cumsum(each[::-1], axis=0)[::-1] for each in self[:3])
        return self.gains(*(each[MIN_PART : 1 - MIN_PART] for each in since))

    def drift(self) -> float:
        """Return the gain of a shift that grows from image to image."""
        v = np.linspace(-1, 1, len(self.score))
        score = np.einsum("n,ni->i", v, self.score)
        information = np.einsum("n,nij->ij", v**2, self.information)
        coupling = np.einsum("n,nip->ip", v, self.coupling)
        return float(self.gains(score[None], information[None], coupling[None])[0][0])


def find_step(bundle: Bundle, pixels: FloatArray) -> ChangePoint | None:
    """Return the step in a swing; None if there is none beyond doubt.

    ``pixels`` (N, C, L, 2) as fitted, px.
    """
    state = bundle.state
    if len(pixels) < 2 * MIN_PART + 1:
        return None
    solved, change = solved_at_rest(bundle, pixels)
    rows = solved.eliminated.cone_rows
    coupling = bundle.unknowns.sensitivity(rows)
    score = solved.eliminated.cone_right - coupling @ change
    cone = _Images(score, rows[..., :N_CONE], coupling, solved.covariance)
    return _certain(cone, state.rotations)


def step_of_poses(poses: Poses, is_slipped: BoolArray) -> ChangePoint | None:
    """Return the step by poses cam_from_pen alone, where many images slipped, or None.

    A fit of all images leaves out those after a large step. ``is_slipped`` (N,) are
    those whose tip is elsewhere; a step is returned if it explains most of them: they
    lie at one other place, and not on the way to the cone.
    """
    R, t = poses.rotations, poses.translations
    if is_slipped.sum() < MIN_PART or len(R) < 2 * MIN_PART + 1:
        return None
    M = contact_matrix(R)
    X = np.asarray(np.linalg.lstsq(M.reshape(-1, 6), -t.ravel())[0], dtype=float)
    W = np.asarray(
        np.linalg.inv(tip_covariances(R, poses.covariances, X[:3])), dtype=float
    )
    weighted = np.swapaxes(M, 1, 2) @ W
    P = np.asarray(np.linalg.inv((weighted @ M).sum(axis=0)), dtype=float)
    off = R @ X[:3] + t - X[3:]
    off = off - M @ (P @ np.einsum("nki,ni->k", weighted, off))
    score = np.einsum("nij,nj->ni", W, off)
    step = _certain(_Images(score, W, -W @ M, P), R)
    if step is None:
        return None
    after = np.arange(len(R)) >= step.first
    away = after if np.mean(after == is_slipped) > 0.5 else ~after
    # The tip that all images share was drawn towards the step: fitted again with it.
    own = R if step.is_tip else np.broadcast_to(-np.eye(3), R.shape)
    A = np.concatenate([M, np.where(after[:, None, None], own, 0.0)], axis=2)
    weighted = np.swapaxes(A, 1, 2) @ W
    solution = np.linalg.solve(
        (weighted @ A).sum(axis=0), -np.einsum("nki,ni->k", weighted, t)
    )
    left, squares = (
        np.einsum("ni,nij,nj->n", each, W, each)[away]
        for each in (A @ solution + t, own @ solution[6:])
    )
    limit = np.maximum(BY_CHANCE, BY_FILES * squares)
    explained = min(np.mean(away == is_slipped), np.mean(left < limit))
    return step if explained > EXPLAINED else None


def _certain(cone: _Images, rotations: FloatArray) -> ChangePoint | None:
    """Return the likelier step of tip and cone, if beyond chance and drift."""
    found = []
    for is_tip, images in ((True, cone.turned(-rotations)), (False, cone)):
        gains, shifts = images.steps()
        best = int(np.argmax(gains))
        found.append(
            ChangePoint(best + MIN_PART, shifts[best], is_tip, float(gains[best]))
        )
    step = max(found, key=lambda each: each.gain)
    needed = max(CERTAIN, MORE_THAN_DRIFT + cone.drift())
    return step if step.gain > needed else None
