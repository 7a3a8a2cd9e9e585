"""Comparison of a pen file with the pen before the camera.

LEDs are alike, so an image shows where they are, not which is which: two LEDs that are
exchanged in the file as a whole fit the images, and only the definition of the pen
frame distinguishes them, see `lightpen.pen_check.draft`. An LED far off its place has
no spot where the file has it; the spots left over, seen from several sides, tell where
it is instead.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from math import sqrt

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.labelling.causes import diagnose, diagnose_mirror
from lightpen.detection.labelling.labels import MODERATE, Labels, label_images
from lightpen.detection.pose import MIN_POSE_LEDS, Poses, fit_poses
from lightpen.detection.reasons import Reason
from lightpen.detection.robust_residuals import disc_residuals, robust_sigma
from lightpen.detection.spots import Spots
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.messages import Message
from lightpen.model.camera import Camera
from lightpen.model.ellipse import centers_from_centroids
from lightpen.model.pen import Pen
from lightpen.pen_check.shifts import Shift, find_shifts, triple

# Spots that are no LED of the pen file but move with the pen: where they sit on it.
#
# Each spot is a ray from the camera, which the pose of its image puts into the pen
# frame. Two rays from different sides suppose a point; one that most views have a spot
# for sits on the pen.


MAX_UNKNOWN_LEDS = 4
MIN_VIEWS = 3
SUPPORT = 0.6  # of the views
REACH = 4.0  # px from a supposed point to its spot
MIN_PARALLAX = 0.02  # rad between the rays that suppose a point
N_SUPPOSING = 8  # views whose rays do, spread over all
FARTHEST = 2000.0  # mm from the pen's origin
REFINED = 3  # times


@dataclass(frozen=True, eq=False)
class UnknownLeds:
    """Points on the pen that the file does not know."""

    points: FloatArray  # (P, 3), pen frame, mm
    pixels: FloatArray  # (N, P, 2), their spots in each view, px; NaN without one


def find_unknown_leds(
    camera: Camera, poses: Poses, pixels: Sequence[FloatArray]
) -> UnknownLeds:
    """Find points on the pen by the spots (K, 2) of each view that are no LED, px."""
    n_views = len(pixels)
    left = _padded(pixels)
    points: list[FloatArray] = []
    spots: list[FloatArray] = []
    while len(points) < MAX_UNKNOWN_LEDS:
        supposed = _supposed(camera, poses, left)
        if not len(supposed):
            break
        counts = np.isfinite(_nearest(camera, poses, supposed, left)[..., 0]).sum(0)
        point = supposed[int(np.argmax(counts))]
        for _ in range(REFINED):
            near = _nearest(camera, poses, point[None], left)[:, 0]
            if np.isfinite(near[:, 0]).sum() < MIN_VIEWS:
                break
            point = _meeting_point(camera, poses, near)
        near = _nearest(camera, poses, point[None], left)[:, 0]
        if np.isfinite(near[:, 0]).sum() < max(MIN_VIEWS, SUPPORT * n_views):
            break
        points.append(point)
        spots.append(near)
        left = np.where((left == near[:, None]).all(axis=2)[..., None], np.nan, left)
    return UnknownLeds(
        np.array(points).reshape(-1, 3),
        np.stack(spots, axis=1) if spots else np.zeros((n_views, 0, 2)),
    )


def _padded(pixels: Sequence[FloatArray]) -> FloatArray:
    most = max((len(each) for each in pixels), default=0)
    padded = np.full((len(pixels), most, 2), np.nan)
    for i, each in enumerate(pixels):
        padded[i, : len(each)] = each
    return padded


def _rays(
    camera: Camera, poses: Poses, pixels: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return origins (N, 3) and unit directions (N, K, 3) of rays in the pen frame."""
    R, t = poses.rotations, poses.translations
    normalised = np.full_like(pixels, np.nan)
    seen = np.isfinite(pixels[..., 0])
    seen[seen] = camera.sees(pixels[seen])
    normalised[seen] = camera.unproject(pixels[seen])
    ahead = np.concatenate([normalised, np.ones((*pixels.shape[:2], 1))], axis=2)
    directions = ahead @ R
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    return -np.einsum("nji,nj->ni", R, t), directions


def _supposed(camera: Camera, poses: Poses, pixels: FloatArray) -> FloatArray:
    """Return points (S, 3) half way between two rays that nearly meet."""
    if not np.isfinite(pixels).any():
        return np.zeros((0, 3))
    origins, directions = _rays(camera, poses, pixels)
    chosen = np.unique(
        np.linspace(0, len(pixels) - 1, N_SUPPOSING).round().astype(np.int64)
    )
    supposed = []
    for i, k in combinations(chosen.tolist(), 2):
        u, v = directions[i][:, None], directions[k][None]
        cosine = np.sum(u * v, axis=2)
        base = origins[k] - origins[i]
        along_u, along_v = np.sum(u * base, axis=2), np.sum(v * base, axis=2)
        with np.errstate(invalid="ignore"):
            wide = np.abs(cosine) < np.cos(MIN_PARALLAX)
        squared_sine = np.where(wide, 1 - cosine**2, 1.0)
        s = (along_u - cosine * along_v) / squared_sine
        w = (cosine * along_u - along_v) / squared_sine
        first = origins[i] + s[..., None] * u
        second = origins[k] + w[..., None] * v
        middle = 0.5 * (first + second)
        near = wide & (np.linalg.norm(middle, axis=2) < FARTHEST)
        supposed.append(middle[near])
    return np.concatenate(supposed) if supposed else np.zeros((0, 3))


def _nearest(
    camera: Camera, poses: Poses, points: FloatArray, pixels: FloatArray
) -> FloatArray:
    """Return the spot at each point in each view, (N, P, 2), px; NaN without one."""
    R_t = np.swapaxes(poses.rotations, 1, 2)
    there = camera.project(points @ R_t + poses.translations[:, None])
    gaps = np.sum((there[:, :, None] - pixels[:, None]) ** 2, axis=3)
    gaps = np.where(np.isfinite(gaps), gaps, np.inf)
    which = gaps.argmin(axis=2)
    near = np.take_along_axis(pixels, which[..., None], axis=1)
    is_near = np.take_along_axis(gaps, which[..., None], axis=2) < REACH**2
    return np.where(is_near, near, np.nan)


def _meeting_point(camera: Camera, poses: Poses, pixels: FloatArray) -> FloatArray:
    """Return the point nearest to the rays of spots (N, 2) of N views."""
    origins, directions = _rays(camera, poses, pixels[:, None])
    seen = np.isfinite(pixels[:, 0])
    u = directions[seen, 0]
    across = np.eye(3) - u[:, :, None] * u[:, None, :]
    right = np.einsum("nij,nj->i", across, origins[seen])
    return np.asarray(np.linalg.lstsq(across.sum(axis=0), right)[0])


MAX_VIEWS = 30
MOVED = 0.006  # of the extent of the spots, by which views differ
N_COMPARED = 20  # spots of each, at most, as every image is compared with all views
BESIDE = 12.0  # px from its place, where an LED's spot is looked for
ENOUGH_VIEWS = 5  # before a pen is said to fit
SAME = 0.3  # mm, within which two coordinates are the same
SURE = 0.05  # mm, standard deviation of a shift that is reported with its direction
SURE_SHARE = 0.1  # of its length, likewise


class MatchFinding(StrEnum):
    """Kinds of findings, with the fields of `Finding` that they use."""

    ADVICE = "advice"
    EXCHANGED = "exchanged"  # two LEDs, axes
    SHIFTED = "shifted"  # LED, by
    SHIFTED_EITHER = "shifted either"  # one of two LEDs; by
    UNSEEN = "unseen"  # LED
    UNKNOWN_LED = "unknown LED"  # by: its place in the pen frame
    MISFIT = "misfit"


@dataclass(frozen=True)
class Finding:
    """A finding."""

    what: MatchFinding
    leds: tuple[int, ...] = ()  # numbers from 1
    by: tuple[float, float, float] = (0.0, 0.0, 0.0)  # pen frame, mm
    is_sure: bool = True  # whether the views differ enough to tell `by`
    # Coordinates that two LEDs have of each other: "y", or "x/y" for either.
    axes: str = ""
    advice: Message | None = None  # problem of the files as a whole, and the remedy

    @property
    def can_be_corrected(self) -> bool:
        """Whether it gives the correct coordinates."""
        is_measured = self.what is MatchFinding.SHIFTED and self.is_sure
        return self.what is MatchFinding.EXCHANGED or is_measured


@dataclass(frozen=True, eq=False)
class PenMatch:
    """Agreement of a pen with views of it."""

    n_views: int
    n_labelled: int  # views in which the pen was found
    n_seen: IntArray  # (L,), views in which each LED was found
    rms: FloatArray  # (L,), distance from where the file puts it, px; NaN if unseen
    sigma: float  # of one image coordinate, px; NaN where no pen was found
    findings: tuple[Finding, ...]  # the most serious first

    @property
    def fits(self) -> bool:
        """Whether the pen was found in enough views, without findings."""
        enough = self.n_labelled > 0 and self.n_views >= ENOUGH_VIEWS
        return enough and not self.findings


def add_view(views: tuple[Spots, ...], spots: Spots) -> tuple[Spots, ...]:
    """Return the views with another image, the newest last.

    It takes the place of a view that is alike, and of the oldest if there are too many;
    smeared images and those with too few spots are passed over.
    """
    if len(spots) < MIN_POSE_LEDS or spots.are_blurred:
        return views
    others = [view for view in views if _differ(view, spots)]
    return (*others, spots)[-MAX_VIEWS:]


def match_pen(camera: Camera, pen: Pen, views: Sequence[Spots]) -> PenMatch:
    """Compare a pen that `lightpen.model.pen.check_leds` passes with views of it."""
    labels = label_images(views, camera, pen, MODERATE)
    found = [
        i
        for i, each in enumerate(labels)
        if each.reason is Reason.NONE and each.whole.sum() >= MIN_POSE_LEDS
    ]
    if not found or 2 * len(found) < len(views):
        advice = diagnose(views, camera, pen) if views else None
        return _without_pen(pen, len(views), advice)
    spots = [views[i] for i in found]
    seen = _Seen.of(camera, pen, spots, [labels[i] for i in found])
    if len(seen.missing) > 1:
        advice = diagnose_mirror(spots, camera, pen)
        if advice:
            return _without_pen(pen, len(views), advice)
    located = _located(camera, pen, seen)
    residuals = _residuals(camera, pen, located, seen.poses)
    sigma = robust_sigma(residuals, 6)
    findings = _findings(pen, located)
    if not findings and sigma > USUAL_SIGMA:
        findings = (Finding(MatchFinding.MISFIT),)
    return PenMatch(
        n_views=len(views),
        n_labelled=len(found),
        n_seen=np.isfinite(located.pixels[..., 0]).sum(axis=0),
        rms=_rms(residuals),
        sigma=sigma,
        findings=findings,
    )


@dataclass(frozen=True, eq=False)
class _Seen:
    """The LEDs of a pen in the N views with a detection."""

    spots: list[Spots]
    taken: IntArray  # (N, L), spot of each LED, -1 without one
    pixels: FloatArray  # (N, L, 2), ellipse centres of the whole spots
    poses: Poses

    @classmethod
    def of(
        cls, camera: Camera, pen: Pen, spots: list[Spots], labels: list[Labels]
    ) -> "_Seen":
        taken = np.stack([label.spot for label in labels])
        whole = np.stack([label.whole for label in labels])
        R = np.stack([label.R for label in labels])
        t = np.stack([label.t for label in labels])
        pixels = _centers(camera, spots, np.where(whole, taken, -1))
        beside = _beside(camera, pen, spots, taken, R, t)
        taken = np.where(beside >= 0, beside, taken)
        # Poses do without LEDs beside their places, the shifts are reported with them.
        poses = fit_poses(camera, pen, pixels, R, t)
        added = _centers(camera, spots, beside)
        pixels = np.where((beside >= 0)[..., None], added, pixels)
        return cls(spots, taken, pixels, poses)

    @property
    def missing(self) -> IntArray:
        """LEDs, from 0, that have no spot in most views."""
        return np.flatnonzero(2 * (self.taken >= 0).sum(axis=0) < len(self.spots))

    @property
    def left_over(self) -> list[FloatArray]:
        """Spots that are no LED, (K, 2) px in each view."""
        return [
            np.delete(each.centers, taken[taken >= 0], axis=0)
            for each, taken in zip(self.spots, self.taken, strict=True)
        ]


@dataclass(frozen=True, eq=False)
class _Located:
    """Positions of the LEDs on the pen."""

    pixels: FloatArray  # (N, L, 2)
    shifts: dict[int, Shift]  # by LED number
    unseen: list[int]  # LED numbers
    unknown: FloatArray  # (P, 3), points on the pen that are no LED of the file

    def leds(self, pen: Pen) -> FloatArray:
        """Return the places of all LEDs, (L, 3)."""
        leds = pen.leds.copy()
        for shift in self.shifts.values():
            leds[shift.led - 1] += shift.by
        return leds


def _located(camera: Camera, pen: Pen, seen: _Seen) -> _Located:
    """Find LEDs far off their places among the spots left over, then small shifts."""
    missing, poses = seen.missing, seen.poses
    unknown = find_unknown_leds(camera, poses, seen.left_over)
    owners = _owners(pen.leds[missing], unknown.points)
    leds, pixels = pen.leds.copy(), seen.pixels.copy()
    for led, owner in zip(missing, owners, strict=True):
        if owner >= 0:
            leds[led] = unknown.points[owner]
            pixels[:, led] = unknown.pixels[:, owner]
    guess = replace(pen, leds=leds)
    found = find_shifts(camera, guess, pixels, poses.rotations, poses.translations)
    shifts = {shift.led: shift for shift in found}
    for led in np.flatnonzero((leds != pen.leds).any(axis=1)).tolist():
        fine = shifts.get(led + 1, Shift(led + 1, (0.0, 0.0, 0.0), 0.0))
        by = triple(leds[led] - pen.leds[led] + fine.by)
        shifts[led + 1] = replace(fine, by=by)
    unseen = {int(led) + 1 for led, at in zip(missing, owners, strict=True) if at < 0}
    owned = [owner for owner in owners if owner >= 0]
    return _Located(
        pixels,
        shifts,
        sorted(unseen - set(shifts)),
        np.delete(unknown.points, owned, axis=0),
    )


def _without_pen(pen: Pen, n_views: int, advice: Message | None) -> PenMatch:
    return PenMatch(
        n_views=n_views,
        n_labelled=0,
        n_seen=np.zeros(pen.n_leds, dtype=np.int64),
        rms=np.full(pen.n_leds, np.nan),
        sigma=float("nan"),
        findings=(Finding(MatchFinding.ADVICE, advice=advice),) if advice else (),
    )


def _differ(view: Spots, other: Spots) -> bool:
    """Whether most spots of two views lie at other places."""
    some = other.centers[:: 1 + len(other) // N_COMPARED]
    gaps = view.centers[:, None] - some
    squares = np.sort(np.einsum("vsi,vsi->vs", gaps, gaps).min(axis=0))
    n = len(squares)
    # np.median takes eight times as long on some ten spots.
    median = (sqrt(squares[(n - 1) // 2]) + sqrt(squares[n // 2])) / 2
    extent = float((other.centers.max(axis=0) - other.centers.min(axis=0)).max())
    return median > MOVED * extent


def _centers(camera: Camera, spots: Sequence[Spots], spot: IntArray) -> FloatArray:
    """Return ellipse centres (N, L, 2) of the spots (N, L) of N views, px or NaN."""
    pixels = np.full((*spot.shape, 2), np.nan)
    for i, each in enumerate(spots):
        has = spot[i] >= 0
        chosen = spot[i, has]
        if len(chosen):
            pixels[i, has] = centers_from_centroids(
                camera, each.centers[chosen], each.shapes[chosen]
            )
    return pixels


def _beside(
    camera: Camera,
    pen: Pen,
    spots: Sequence[Spots],
    taken: IntArray,
    R: FloatArray,
    t: FloatArray,
) -> IntArray:
    """Return the unassigned spot nearest to each LED without a spot, (N, L)."""
    beside = np.full_like(taken, -1)
    there = camera.project(pen.leds @ np.swapaxes(R, 1, 2) + t[:, None])
    for i, each in enumerate(spots):
        left_over = np.setdiff1d(np.arange(len(each)), taken[i])
        for led in np.flatnonzero(taken[i] < 0) if len(left_over) else ():
            gaps = np.linalg.norm(each.centers[left_over] - there[i, led], axis=1)
            if gaps.min() < BESIDE:
                beside[i, led] = left_over[gaps.argmin()]
    return beside


def _owners(leds: FloatArray, points: FloatArray) -> list[int]:
    """Return the index of the point of each missing LED, or -1.

    As few coordinates as possible of the file are wrong then; of equals, the nearest.
    """
    from scipy.optimize import linear_sum_assignment  # takes 0.2 s

    gaps = np.abs(leds[:, None] - points)
    costs = (gaps > SAME).sum(axis=2) + 1e-6 * gaps.sum(axis=2)
    rows, columns = linear_sum_assignment(costs)
    owners = dict(zip(rows.tolist(), columns.tolist(), strict=True))
    return [owners.get(led, -1) for led in range(len(leds))]


def _residuals(camera: Camera, pen: Pen, located: _Located, start: Poses) -> FloatArray:
    """Return residuals against the file, by poses fitted to the LEDs where they are."""
    there = replace(pen, leds=located.leds(pen))
    pixels = located.pixels
    poses = fit_poses(camera, there, pixels, start.rotations, start.translations)
    R_t = np.swapaxes(poses.rotations, 1, 2)
    lever = pen.leds @ R_t
    return disc_residuals(
        camera,
        lever,
        lever + poses.translations[:, None],
        pen.normals @ R_t,
        pen.diameter / 2,
        pixels,
    )[0]


def _rms(residuals: FloatArray) -> FloatArray:
    squares = np.nansum(residuals**2, axis=(0, 2))
    n_seen = np.isfinite(residuals[..., 0]).sum(axis=0)
    rms: FloatArray = np.sqrt(squares / np.maximum(n_seen, 1))
    return np.where(n_seen > 0, rms, np.nan)


def _findings(pen: Pen, located: _Located) -> tuple[Finding, ...]:
    shifts = located.shifts
    left = dict(sorted(shifts.items(), key=lambda item: -item[1].length))
    findings = []
    for one, other in combinations(sorted(shifts), 2):
        axes = _exchanged(pen.leds, shifts[one], shifts[other])
        if axes and one in left and other in left:
            findings.append(Finding(MatchFinding.EXCHANGED, (one, other), axes=axes))
            del left[one], left[other]
    for shift in left.values():
        is_sure = shift.sigma < max(SURE, SURE_SHARE * shift.length)
        leds = (shift.led, shift.rival) if shift.rival else (shift.led,)
        what = MatchFinding.SHIFTED_EITHER if shift.rival else MatchFinding.SHIFTED
        findings.append(Finding(what, leds, shift.by, is_sure))
    findings += [Finding(MatchFinding.UNSEEN, (led,)) for led in located.unseen]
    findings += [
        Finding(MatchFinding.UNKNOWN_LED, by=triple(point)) for point in located.unknown
    ]
    return tuple(findings)


def _exchanged(leds: FloatArray, one: Shift, other: Shift) -> str:
    """Return the coordinates that are swapped between two LEDs, such as "y".

    Of two LEDs that differ in two coordinates, exchanging either gives the same two
    places: "x/y".
    """
    first, second = leds[one.led - 1], leds[other.led - 1]
    differ = np.abs(first - second) > SAME
    swapped = np.abs(first + one.by - second) < SAME
    swapped &= np.abs(second + other.by - first) < SAME
    stay = (np.abs(one.by) < SAME) & (np.abs(other.by) < SAME)
    chosen = swapped & differ
    if not np.all(swapped | stay) or not np.any(chosen):
        return ""
    either = 2 * chosen.sum() == differ.sum()
    axes = differ if either else chosen
    names = [name for name, is_it in zip("xyz", axes, strict=True) if is_it]
    return ("/" if either else ", ").join(names)
