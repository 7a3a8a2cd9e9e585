"""Views of another setting of the camera, by what they say of views left out.

Views are parted into two groups whose cameras differ by zoom and principal point: at
some view in time, or in any order. Each view is predicted by the others,
once with one camera and once with two. A change counts as found where two cameras
predict nearly all views better, by more than views without a change do by chance: the
mean of the gains in the logarithm of the squares exceeds `SURE` standard errors and
`IN_TIME` root mean squares; where the groups were chosen, `IN_GROUPS` of these, and the
error of all views is `MUCH` larger by one camera. In none of 1800 sets without a change
is it so. All is linear about the fit of one camera, so it takes no other fit.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen_extensions.boards.adjustment import BoardFit, fit_board_poses
from lightpen_extensions.boards.distortion import fit_camera, moved_in_image
from lightpen_extensions.boards.effects import held_out_errors
from lightpen_extensions.boards.observing import Views, listed_names
from lightpen_extensions.boards.start import start_board_poses

FEWEST = 4  # views of a group that a set is refused for
LEAST_GROUP = 2
SURE, IN_TIME, IN_GROUPS, MUCH = 3.8, 0.67, 0.75, 1.12
CLEAR = 1.03  # ratio of the errors: the set is of two settings
USELESS = 0.001  # of the image's longer side, by which a change moves the image
MAX_ROUNDS = 10
N_WAYS = 3  # zoom and shift of the principal point along x and y
RIDGE = 1e-10  # of a normal matrix scaled to ones
WORSE = 1.3  # ratio of the residuals of first groups that are turned to those before
# Ratio of the errors of views left out, or of residuals; its share of that by a change.
# Of 1000 sets without rotated images, the largest are 1.17 and 1.09.
BETTER, CLOSER, NEARLY = 1.25, 1.15, 0.9
MOSTLY = 0.5  # mean of the gains over their root mean square


@dataclass(frozen=True, eq=False)
class CameraChange:
    """A camera that changed while its views were taken."""

    ratio: float  # cross-validated error by one camera over that by two
    is_second: BoolArray  # (V,), which views were taken after the change
    difference: FloatArray  # (4 + n,), of the intrinsics, after less before
    in_image: float  # difference of the projections of a point, px rms
    settings: tuple[Camera, Camera]

    @property
    def fewer(self) -> BoolArray:
        """Mask of the views in the smaller group, (V,)."""
        return min(self.is_second, ~self.is_second, key=np.count_nonzero)

    @property
    def is_clear(self) -> bool:
        """Whether one camera cannot have taken the views."""
        matters = self.in_image > USELESS * max(self.settings[0].image_size)
        return self.ratio > CLEAR and matters


def find_change(fitted: BoardFit) -> CameraChange | None:
    """Return the change of the camera that predicts views best, if it is significant.

    ``fitted`` is of one camera, the points of its board as all views have them.
    """
    views = _ViewEquations.of(fitted)
    n_views = len(views.squares)
    if n_views < 2 * FEWEST:
        return None
    order = np.arange(n_views)
    steps = [(order >= k).astype(np.float64) for k in range(LEAST_GROUP, n_views - 1)]
    in_time = min(steps, key=lambda share: views.fitted(share)[1])
    shares = [in_time, *(_settled_groups(views, start) for start in views.starts())]
    limits = np.array([IN_TIME] + [IN_GROUPS] * (len(shares) - 1))
    alone = views.held_out(np.zeros(n_views))
    errors = np.stack([views.held_out(share) for share in shares])
    gains = np.log(alone / errors)
    sizes = np.sqrt(np.mean(gains**2, axis=1))
    by_chance = gains.std(axis=1, ddof=1) / np.sqrt(n_views)
    is_found = gains.mean(axis=1) > np.maximum(limits * sizes, SURE * by_chance)
    ratios = np.sqrt(alone.sum() / errors.sum(axis=1))
    is_found[1:] &= ratios[1:] > MUCH
    if not is_found.any():
        return None
    best = int(np.argmin(np.where(is_found, errors.sum(axis=1), np.inf)))
    camera = fitted.state.cameras[0]
    step, _ = views.fitted(shares[best])
    n = len(camera.intrinsics)
    common, change = step[: len(views.way)], views.way @ step[len(views.way) :]
    before = camera.intrinsics + common[:n]
    settings = (
        camera.with_intrinsics(before),
        camera.with_intrinsics(before + change[:n]),
    )
    moved = moved_in_image(camera, change[:n])
    second = shares[best] > 0.5
    return CameraChange(float(ratios[best]), second, change[:n], moved, settings)


@dataclass(frozen=True, eq=False)
class _ViewEquations:
    """Normal equations of each view about all but its pose, of one camera."""

    information: FloatArray  # (V, p, p)
    scores: FloatArray  # (V, p)
    squares: FloatArray  # (V,), px^2
    prior: FloatArray  # (p, p), for points of 1 px noise
    way: FloatArray  # (p, k), how zoom and shift change the unknowns

    @classmethod
    def of(cls, fitted: BoardFit) -> "_ViewEquations":
        camera = fitted.state.cameras[0]
        way = np.zeros((len(fitted.prior), N_WAYS))
        way[0, 0], way[1, 0], way[2, 1], way[3, 2] = camera.fx, camera.fy, 1.0, 1.0
        squares = np.nansum(np.square(fitted.residuals), axis=(1, 2, 3))
        prior = fitted.sigma**2 * fitted.prior
        return cls(fitted.information, fitted.scores, squares, prior, way)

    def starts(self) -> list[FloatArray]:
        """Return the first groups of views, (V,) each: every second, and by scores."""
        order, scores = np.arange(len(self.squares)), self.scores @ self.way
        known = np.einsum("pk,vpq,qk->k", self.way, self.information, self.way)
        main = np.linalg.svd(scores / np.sqrt(known), full_matrices=False)[0]
        groups = (order % 2 == 1, main[:, 0] > 0, main[:, 1] > 0)
        return [group.astype(np.float64) for group in groups]

    def _parted(self, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the normal equations of each view, the change being unknown, too."""
        n_views, p = self.scores.shape
        both = np.zeros((n_views, p, p + N_WAYS))
        both[:, :, :p] = np.eye(p)
        both[:, :, p:] = share[:, None, None] * self.way
        turned = np.swapaxes(both, 1, 2)
        scores = (turned @ self.scores[..., None])[..., 0]
        return turned @ self.information @ both, scores

    def _total(
        self, information: FloatArray, scores: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        p = len(self.prior)
        normal, right = information.sum(axis=0), scores.sum(axis=0)
        normal[:p, :p] += self.prior
        right[:p] = 0.0  # the fit of one camera is at its optimum
        return normal, right

    def fitted(self, share: FloatArray) -> tuple[FloatArray, float]:
        """Return the step of all unknowns, (p + 3,), and the squares that it leaves."""
        normal, right = self._total(*self._parted(share))
        step = _solved(normal, right)
        return step, float(self.squares.sum() - right @ step)

    def of_each(self, share: FloatArray, step: FloatArray) -> FloatArray:
        """Return the squares of the residuals of each view after a step, (V,)."""
        information, scores = self._parted(share)
        by_step = np.einsum("i,vij,j->v", step, information, step)
        return np.asarray(self.squares - 2 * scores @ step + by_step)

    def held_out(self, share: FloatArray) -> FloatArray:
        """Return the squares of the residuals of each view by the others, (V,)."""
        information, scores = self._parted(share)
        normal, right = self._total(information, scores)
        step = _solved(normal - information, right - scores)
        by_step = np.einsum("vi,vij,vj->v", step, information, step)
        errors = self.squares - 2 * np.sum(scores * step, axis=1) + by_step
        return np.asarray(np.maximum(errors, 1e-12))


def _solved(normal: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solution of normal equations, 0 of what they leave open."""
    diagonal = np.einsum("...ii->...i", normal)
    scale = 1 / np.sqrt(np.maximum(diagonal, 1e-300))
    scale[diagonal <= 0] = 0.0
    scaled = normal * scale[..., :, None] * scale[..., None, :]
    scaled = scaled + RIDGE * np.eye(normal.shape[-1])
    solved = np.linalg.solve(scaled, (scale * right)[..., None])[..., 0]
    return np.asarray(scale * solved)


def _settled_groups(views: _ViewEquations, share: FloatArray) -> FloatArray:
    """Return the groups after views have moved to the one that fits them better."""
    for _ in range(MAX_ROUNDS):
        step, _ = views.fitted(share)
        one, other = (
            views.of_each(np.full(len(share), part), step) for part in (0.0, 1.0)
        )
        now = (other < one).astype(np.float64)
        if np.array_equal(now, share) or not 2 <= now.sum() <= len(now) - 2:
            break
        share = now
    return share


def find_rotated(
    views: Views, fitted: BoardFit, change: CameraChange | None
) -> BoolArray:
    """Return which views are of images rotated by 180 degrees, (V,).

    Views that pull the camera to the other side than most are turned round, then those
    that fit better so. They count as rotated where that predicts all views better, as
    by a change of the camera, or better at all and leaves much smaller residuals.
    """
    by_change = 0.0 if change is None else NEARLY * change.ratio
    none = np.zeros(views.n_views, dtype=np.bool_)
    turned, now = _ViewEquations.of(fitted).starts()[1] > 0.5, fitted
    try:
        for n_done in range(MAX_ROUNDS):
            now = fit_camera(_turned(views, turned), now.state.cameras[0])
            if now.rms > fitted.rms * (1.0 if n_done else WORSE):
                return none
            rms = []
            for way in (_turned(views, none), _turned(views, ~none)):
                poses = start_board_poses(now.state.cameras[0], way)
                fit = fit_board_poses(way, replace(now.state, poses=poses))
                rms.append(fit.view_rms[:, 0])
            before, turned = turned, rms[1] < rms[0]
            if np.array_equal(before, turned):
                break
        turned = before
        for v in range(views.n_views):  # each by its part in the fit of all
            other = turned ^ (np.arange(views.n_views) == v)
            by_other = fit_camera(_turned(views, other), now.state.cameras[0])
            if by_other.rms < now.rms:
                turned, now = other, by_other
        errors = held_out_errors(views, fitted)
        less = held_out_errors(_turned(views, turned), now)
    except CalibrationError:  # the camera does not image them so
        return none
    gains = np.log(errors / less)
    mean, size = gains.mean(), np.sqrt(np.mean(gains**2))
    ratio = np.sqrt(np.sum(errors**2) / np.sum(less**2))
    is_better = ratio > max(BETTER, by_change) and mean > MOSTLY * size
    is_closer = fitted.rms > max(CLOSER, by_change) * now.rms
    is_better |= is_closer and ratio > 1.0 and mean > 0.0
    return min(turned, ~turned, key=np.count_nonzero) if is_better else none


def _turned(views: Views, which: BoolArray) -> Views:
    """Return the views with the images of some rotated by 180 degrees."""
    other = np.array(views.image_sizes[0]) - 1.0 - views.pixels
    return replace(
        views, pixels=np.where(which[:, None, None, None], other, views.pixels)
    )


def change_error(change: CameraChange, names: tuple[str, ...]) -> CalibrationError:
    """Return the error of a change that no calibration can bridge."""
    one, other = (
        message(
            "intrinsics.setting",
            fx=camera.fx,
            cx=camera.cx,
            cy=camera.cy,
            n_views=int(which.sum()),
            names=_listed(names, which),
        )
        for which, camera in zip(
            (~change.is_second, change.is_second), change.settings, strict=True
        )
    )
    return CalibrationError("intrinsics.two-settings", one=one, other=other)


def rotated_message(names: tuple[str, ...], which: BoolArray) -> Message:
    """Return the message on images that are rotated by 180 degrees."""
    return message(
        "intrinsics.turned",
        names=_listed(names, which),
        n_named=int(which.sum()),
        n_views=len(names),
    )


def message_on_change(change: CameraChange, names: tuple[str, ...]) -> Message:
    """Return the message on a change that does not make the set useless."""
    fx, _, cx, cy, *_ = change.difference.tolist()
    return message(
        "intrinsics.apart",
        names=_listed(names, change.fewer),
        n_named=int(change.fewer.sum()),
        n_views=len(names),
        px=change.in_image,
        fx=fx,
        cx=cx,
        cy=cy,
    )


def changed_camera(camera: Camera, change: CameraChange) -> Camera:
    """Return a camera whose covariance includes the change."""
    added = np.outer(change.difference, change.difference) / 4
    field, covariance = camera.lens_field, camera.covariance
    if field is not None and field.intrinsics_covariance is not None:
        beside = field.intrinsics_covariance + added
        field = replace(field, intrinsics_covariance=beside)
    if covariance is not None:
        covariance = covariance + added
    return replace(camera, covariance=covariance, lens_field=field)


def _listed(names: tuple[str, ...], which: BoolArray) -> str:
    return listed_names(tuple(np.array(names)[which].tolist()))
