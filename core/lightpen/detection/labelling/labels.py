"""Assignment of spots to LEDs.

A triple of spots is supposed to be a triple of LEDs; the size of the spots shows their
distance, which orders the suppositions by plausibility. Each fixes a pose (P3P), which
predicts the other LEDs. A pose is believed when it explains at least six spots at the
noise level, when chance would hardly do as well, and when no other labelling comes near
it; else the image is refused. More and more triples are tried until one is believed.

Five spots are enough where there are no others, and no other labelling of four or more
of them is found among all that a few triples allow; or where the pose before leads to
them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.labelling.constellation import (
    FAR,
    FEWEST_LEDS,
    MIN_CERTAIN_LEDS,
    UNWHOLE,
    Constellation,
    SpotArrays,
    constellation_of,
    spot_arrays,
)
from lightpen.detection.labelling.hypotheses import (
    SearchEffort,
    first_of_each,
    lookalike_poses,
    poses_from_triples,
)
from lightpen.detection.labelling.matching import (
    AREA_RANGE,
    Candidates,
    join,
    log_false_alarms,
    match,
    settle,
)
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import Spots
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

MAX_LOG_FALSE_ALARMS = -4.0
MAX_RMS = 1.0  # px
# Where no more LEDs than necessary are seen, one of them could be a stray spot that
# happens to lie near the place of a hidden LED, the more so among other stray spots, or
# where there are only five, which a pose can follow farther.
MAX_RMS_OF_FEWEST = 0.3  # px
MAX_RMS_OF_FEWEST_AMONG_OTHERS = 0.1  # px
RIVAL_SIGMA = 0.1  # px, at least, when two labellings are compared
UNEXPLAINED = 25.0  # what an LED without a spot adds to the misfit, sigma^2
RIVAL_MARGIN = 30.0  # in misfit, by which a rival must be worse: more than an LED
SAME_ROTATION = 0.05  # rad

HYPOTHESES_AT_ONCE = 4000

MAX_OFF_CENTER = 0.5  # of the radius, of a cut disc: half a disc is off by 0.42
DISPLACED_REACH = 8.0  # px, of an LED from its place in the pen file
MIN_DISPLACED = 5  # images that show it, and half of all


@dataclass(frozen=True, eq=False)
class Labels:
    """The spots of one image that are LEDs, and the pose by them."""

    spot: IntArray  # (L,), spot of each LED, -1 where it has none; all -1 if refused
    # (L,). LEDs whose spot is a whole disc. A merged or cut spot is labelled when it
    # lies in the middle of the LED's disc, but its centre is not that of the LED, and
    # it takes part in the pose only if the whole spots alone do not suffice.
    whole: BoolArray
    R: FloatArray  # (3, 3)
    # (3,), cam_from_pen, mm, by least squares on the whole LEDs; nan if refused.
    t: FloatArray
    # Root mean square of the residuals, per image coordinate, px; nan if refused.
    rms_px: float
    reason: Reason  # why the image was refused; `Reason.NONE` where it was not


EFFORTS = (
    SearchEffort(n_triples=1, n_hypotheses=24, n_poses=8, n_settled=3),
    SearchEffort(n_triples=4, n_hypotheses=24, n_poses=16, n_settled=4),
    SearchEffort(n_triples=16, n_hypotheses=40, n_poses=32, n_settled=6),
    SearchEffort(n_triples=40, n_hypotheses=32, n_poses=60, n_settled=6),
    SearchEffort(n_triples=110, n_hypotheses=32, n_poses=100, n_settled=8),
    SearchEffort(n_triples=4, n_hypotheses=700, n_poses=100, n_settled=8, sized=False),
)
MODERATE = EFFORTS[:3]
# Every triple of LEDs for a few triples of spots: a second answer is among them.
ALL_ANSWERS = (
    SearchEffort(n_triples=4, n_hypotheses=700, n_poses=300, n_settled=24, sized=False),
)


def label_images(
    spots: Sequence[Spots],
    camera: Camera,
    pen: Pen,
    efforts: Sequence[SearchEffort] = EFFORTS,
) -> list[Labels]:
    """Label the LEDs in images that have nothing to do with each other.

    The efforts are made one after the other until an image is labelled. A labelling is
    right or refused; `Labels.reason` shows. An LED that in most images has a spot
    beside its place, rather than at it, is taken to be displaced in the pen file and
    gets these spots; the poses do without it.
    """
    constellation = constellation_of(pen)
    labels = _label_whole(spots, camera, constellation, efforts)
    # The last resort where whole spots do not suffice.
    again = [
        i
        for i, (s, found) in enumerate(zip(spots, labels, strict=True))
        if found.reason in (Reason.TOO_FEW_LEDS, Reason.NOT_THE_PEN)
        and np.any(s.flaws & UNWHOLE)
        and len(s) >= constellation.min_leds
    ]
    retried = _label_whole(
        [spots[i] for i in again], camera, constellation, efforts, use_unwhole=True
    )
    for i, found in zip(again, retried, strict=True):
        labels[i] = found
    five = [i for i, s in enumerate(spots) if _is_five(s, labels[i], constellation)]
    if five:
        by_five = constellation_of(pen, FEWEST_LEDS)
        found_five = _label_whole(
            [spots[i] for i in five], camera, by_five, ALL_ANSWERS
        )
        for i, found in zip(five, found_five, strict=True):
            if found.reason is Reason.NONE:
                labels[i] = found
    return _with_displaced(labels, spots, camera, pen)


def label_spots(spots: Spots, camera: Camera, pen: Pen) -> Labels:
    """Label the LEDs in one image.

    See Also
    --------
    label_images : For many images, at a tenth of the time for each.
    """
    return label_images([spots], camera, pen)[0]


def _is_five(spots: Spots, labels: Labels, pen: Constellation) -> bool:
    """Return whether a refused image shows five whole spots and no others."""
    refused = labels.reason in (Reason.TOO_FEW_LEDS, Reason.NOT_THE_PEN)
    n_whole = np.count_nonzero(spots.flaws & UNWHOLE == 0)
    return bool(refused and n_whole == FEWEST_LEDS < pen.min_leds)


def _label_whole(
    spots: Sequence[Spots],
    camera: Camera,
    pen: Constellation,
    efforts: Sequence[SearchEffort],
    use_unwhole: bool = False,
) -> list[Labels]:
    """Label images by their usable spots with growing effort."""
    labels: list[Labels] = []
    pending: list[int] = []
    n_leds = len(pen.leds)
    for i, s in enumerate(spots):
        n_usable = len(s) if use_unwhole else np.sum(s.flaws & UNWHOLE == 0)
        reason = Reason.TOO_FEW_LEDS if len(s) else Reason.EMPTY
        if n_usable >= pen.min_leds:
            reason = Reason.NOT_THE_PEN
            pending.append(i)
        labels.append(_refused(n_leds, reason))
    if not pending:
        return labels
    # Images with like numbers of spots go together, as arrays are padded.
    pending.sort(key=lambda i: len(spots[i]))
    for effort in efforts:
        chunk = max(1, HYPOTHESES_AT_ONCE // (effort.n_triples * effort.n_hypotheses))
        left: list[int] = []
        for start in range(0, len(pending), chunk):
            images = pending[start : start + chunk]
            some = [spots[i] for i in images]
            sight = spot_arrays(some, camera, pen.radius, use_unwhole)
            found = _search(sight, pen, effort, some)
            for i, label in zip(images, found, strict=True):
                labels[i] = label
                if label.reason is Reason.NOT_THE_PEN:
                    left.append(i)
        pending = left
    return labels


def _with_displaced(
    labels: list[Labels], spots: Sequence[Spots], camera: Camera, pen: Pen
) -> list[Labels]:
    """Give LEDs that lie off their place in most images the spots they have there."""
    labelled = [i for i, one in enumerate(labels) if one.reason is Reason.NONE]
    beside = np.full((len(labels), pen.n_leds), -1)
    for i in labelled:
        bare = np.flatnonzero(labels[i].spot < 0)
        if len(bare) in (0, pen.n_leds - len(spots[i])):
            continue
        left_over = np.setdiff1d(np.arange(len(spots[i])), labels[i].spot)
        there = camera.project(pen.leds[bare] @ labels[i].R.T + labels[i].t)
        gaps = spots[i].centers[left_over] - there[:, None]
        squares = np.einsum("lsi,lsi->ls", gaps, gaps)
        near = squares.min(axis=1) < DISPLACED_REACH**2
        beside[i, bare[near]] = left_over[squares.argmin(axis=1)[near]]
    n_beside = (beside >= 0).sum(axis=0)
    displaced = (n_beside >= MIN_DISPLACED) & (2 * n_beside > len(labelled))
    result = list(labels)
    for i in np.flatnonzero((beside[:, displaced] >= 0).any(axis=1)).tolist():
        added = np.where(displaced, beside[i], -1)
        spot = np.where(added >= 0, added, labels[i].spot)
        whole = (spot >= 0) & (spots[i].flaws[spot] & UNWHOLE == 0)
        result[i] = replace(labels[i], spot=spot, whole=whole)
    return result


def _search(
    sight: SpotArrays, pen: Constellation, effort: SearchEffort, spots: Sequence[Spots]
) -> list[Labels]:
    candidates = poses_from_triples(sight, pen, effort)
    settled, best = _with_lookalikes(sight, pen, settle(sight, pen, candidates))
    return _judge(sight, pen, settled, best, spots)


def _with_lookalikes(
    sight: SpotArrays, pen: Constellation, settled: Candidates
) -> tuple[Candidates, IntArray]:
    """Return candidates with the lookalikes of the best, and the best of all."""
    best = _best(sight, pen, settled)
    if len(best):
        rivals = lookalike_poses(sight, pen, settled.of(best))
        if len(rivals):
            settled = join([settled, settle(sight, pen, rivals)])
            best = _best(sight, pen, settled)
    return settled, best


def _best(sight: SpotArrays, pen: Constellation, candidates: Candidates) -> IntArray:
    """Return the least accidental candidate of each image that has a credible one."""
    logs = log_false_alarms(sight, candidates)
    low, high = AREA_RANGE
    n = candidates.n_explained
    alone = n == sight.usable.sum(axis=1)[candidates.image]
    certain = min(MIN_CERTAIN_LEDS, len(pen.leds))
    spared = alone & (n >= certain)
    strict = np.where(spared, MAX_RMS_OF_FEWEST, MAX_RMS_OF_FEWEST_AMONG_OTHERS)
    max_rms = np.where(n > certain, MAX_RMS, strict)
    credible = (n >= pen.min_leds) & (candidates.rms < max_rms)
    credible &= (candidates.area_ratio > low) & (candidates.area_ratio < high)
    which = np.flatnonzero(credible & (logs < MAX_LOG_FALSE_ALARMS))
    return which[first_of_each(candidates.image[which], logs[which], 1)]


def _judge(
    sight: SpotArrays,
    pen: Constellation,
    candidates: Candidates,
    best: IntArray,
    spots: Sequence[Spots],
) -> list[Labels]:
    """Return the labels of each image: its best candidate, if none comes near it."""
    labels = [_refused(len(pen.leds), Reason.NOT_THE_PEN) for _ in spots]
    if not len(best):
        return labels
    of_image = np.full(len(spots), -1)
    of_image[candidates.image[best]] = best
    judged = candidates.of(of_image[candidates.image] >= 0)
    champion = candidates.of(of_image[judged.image])
    sigma = np.maximum(champion.rms, RIVAL_SIGMA)
    close = _misfit(judged, sigma) - _misfit(champion, sigma) < RIVAL_MARGIN
    rival = close & _differ(judged, champion)
    ambiguous = np.zeros(len(spots), dtype=bool)
    ambiguous[judged.image[rival]] = True
    winners = candidates.of(best)
    unwhole = _on_unwhole(sight, pen, winners)
    for i, image in enumerate(winners.image):
        if ambiguous[image]:
            labels[image] = _refused(len(pen.leds), Reason.AMBIGUOUS)
            continue
        spot = np.where(winners.spot[i] >= 0, winners.spot[i], unwhole[i])
        flaws = spots[image].flaws[spot]
        labels[image] = Labels(
            spot=spot,
            whole=(spot >= 0) & (flaws & UNWHOLE == 0),
            R=winners.R[i],
            t=winners.t[i],
            rms_px=float(winners.rms[i]),
            reason=Reason.NONE,
        )
    return labels


def _on_unwhole(
    sight: SpotArrays, pen: Constellation, candidates: Candidates
) -> IntArray:
    """Return which merged or cut spot lies on the disc of each LED, (C, L)."""
    if np.all(sight.unwhole_points == FAR):
        return np.full_like(candidates.spot, -1)
    middle = np.einsum("cij,j->ci", candidates.R, pen.leds.mean(axis=0)) + candidates.t
    radii = sight.focal * pen.radius / middle[:, 2:]
    unwhole = replace(sight, points=sight.unwhole_points)
    image, R, t = candidates.image, candidates.R, candidates.t
    return match(unwhole, pen, image, R, t, MAX_OFF_CENTER * radii).spot


def _misfit(candidates: Candidates, sigma: FloatArray) -> FloatArray:
    """Return the sum of squared residuals in sigma, bounded for each LED."""
    squares = (candidates.residuals / sigma[:, None]) ** 2
    bounded = np.where(
        candidates.spot >= 0, np.minimum(squares, UNEXPLAINED), UNEXPLAINED
    )
    return np.asarray(bounded.sum(axis=1))


def _differ(some: Candidates, others: Candidates) -> BoolArray:
    """Return where two candidates name LEDs differently or see another posture."""
    both = (some.spot >= 0) & (others.spot >= 0)
    renamed = (both & (some.spot != others.spot)).any(axis=1)
    few = 2 * both.sum(axis=1) < others.n_explained
    trace = np.einsum("cij,cij->c", some.R, others.R)
    turned = trace < 1 + 2 * np.cos(SAME_ROTATION)
    return np.asarray(renamed | few | turned)


def _refused(n_leds: int, reason: Reason) -> Labels:
    return Labels(
        spot=np.full(n_leds, -1),
        whole=np.zeros(n_leds, dtype=bool),
        R=np.full((3, 3), np.nan),
        t=np.full(3, np.nan),
        rms_px=float("nan"),
        reason=reason,
    )
