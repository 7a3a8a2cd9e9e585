"""The linear model of a fit, row by row, for noise that is correlated over images."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.linearised import N_CONE, N_TURN, CameraView
from lightpen.estimation.bundle.unknowns import Unknowns


class WhitenedEquations(NamedTuple):
    """Normal equations of all images by generalised least squares.

    The unknowns of each image are eliminated.
    """

    information: FloatArray  # (p, p)
    gradient: FloatArray  # (p,)
    # Sum of the squared residuals after the unknowns of single images were eliminated.
    squares: float
    log_volume: float  # log determinants of the noise and of the eliminated unknowns
    n_free: int  # observations less eliminated unknowns


RIDGE = 1e-12  # of the mean of a diagonal, where an image shows nothing


@dataclass(frozen=True, eq=False)
class ImageRows:
    """The linear model of a fit, in units of the standard deviation that weighs it.

    M is the number of coordinates of an image.
    """

    eliminated: FloatArray  # (N, M, q), derivatives by the unknowns of each image
    nuisance_covariance: FloatArray  # (N, q, q), inverse of their normal matrix
    # (N, M, p), J of equation (13): ``common`` with those of each image eliminated.
    projected: FloatArray
    common: FloatArray  # (N, M, p), derivatives by the common unknowns
    residuals: FloatArray  # (N, M)
    used: BoolArray  # (N, M)

    def whitened(
        self, coefficients: FloatArray, jitter: FloatArray | None
    ) -> list["WhitenedEquations"]:
        """Return the equations by generalised least squares for B coefficients.

        Parameters
        ----------
        coefficients : (B,) array
            f of equation (12), for noise of variance 1. Where the image before does not
            show a coordinate, it starts again.
        jitter : (3, 3) array or None
            Covariance of the jitter of the seat, mm^2 for that noise.
        """
        T = self.eliminated
        J = np.concatenate([self.common, self.residuals[..., None]], axis=2)
        follows = np.zeros(self.used.shape)
        follows[1:] = self.used[1:] & self.used[:-1]
        known = np.zeros((T.shape[2], T.shape[2]))
        if jitter is not None:
            known[N_TURN:, N_TURN:] = np.linalg.inv(jitter)
        sums, logs, inner, beside, right = [], [], [], [], []
        for coefficient in coefficients:
            carried = coefficient * follows
            weight = self.used / np.sqrt(1 - carried**2)
            logs.append(-2 * float(np.log(weight[self.used]).sum()))
            own, past = weight[..., None] * T, np.zeros_like(T)
            past[1:] = -(weight * carried)[1:, :, None] * T[:-1]
            rows = weight[..., None] * J
            rows[1:] -= (weight * carried)[1:, :, None] * J[:-1]
            flat = rows.reshape(-1, rows.shape[-1])
            sums.append(flat.T @ flat)
            from_own, from_past = np.swapaxes(own, 1, 2), np.swapaxes(past, 1, 2)
            D, C = from_own @ own + known, from_own @ rows
            D[:-1] += from_past[1:] @ past[1:]
            C[:-1] += from_past[1:] @ rows[1:]
            D += RIDGE * np.trace(D.sum(axis=0)) / len(D) * np.eye(D.shape[1])
            inner.append(D)
            beside.append(from_past @ own)
            right.append(C)
        left, volumes = _eliminate(*map(np.array, (inner, beside, right)))
        normal = np.array(sums) - left
        n_free = int(self.used.sum()) - N_TURN * len(T)
        return [
            WhitenedEquations(
                N[:-1, :-1], N[:-1, -1], float(N[-1, -1]), log + volume, n_free
            )
            for N, log, volume in zip(normal, logs, volumes, strict=True)
        ]


def _eliminate(
    inner: FloatArray, beside: FloatArray, right: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Eliminate the unknowns of images by block-tridiagonal elimination.

    Their normal matrices (B, N, q, q) are ``inner``, and ``beside`` of an image
    (columns) with the one before (rows); ``right`` (B, N, q, k) is with the common
    unknowns. Return what is taken off the normal matrix of these, (B, k, k), and the
    logarithm of the determinants of what was eliminated, (B,).
    """
    left = np.zeros((len(inner), right.shape[-1], right.shape[-1]))
    volumes = np.zeros(len(inner))
    by_next: FloatArray = np.zeros_like(inner[:, 0])
    gain: FloatArray = np.zeros_like(right[:, 0])
    for i in range(inner.shape[1]):
        through = np.swapaxes(beside[:, i], 1, 2)
        D, C = inner[:, i] - through @ by_next, right[:, i] - through @ gain
        both = C if i + 1 == inner.shape[1] else np.dstack([C, beside[:, i + 1]])
        solved: FloatArray = np.asarray(np.linalg.solve(D, both), dtype=np.float64)
        gain, by_next = solved[..., : C.shape[-1]], solved[..., C.shape[-1] :]
        left += np.swapaxes(C, 1, 2) @ gain
        volumes += np.linalg.slogdet(D)[1]
    return left, volumes


def summed_products(rows: FloatArray, coefficient: float) -> FloatArray:
    """Return the sum over pairs of images in (13), (p, p), for rows (N, M, p)."""
    past = np.empty_like(rows)
    carried = np.zeros_like(rows[0])
    for i, row in enumerate(rows):
        past[i] = carried
        carried = coefficient * (carried + row)
    p = rows.shape[-1]
    flat, before = rows.reshape(-1, p), past.reshape(-1, p)
    cross = flat.T @ before
    return np.asarray(flat.T @ flat + cross + cross.T)


def rows_of(
    unknowns: Unknowns,
    views: tuple[CameraView, ...],
    used: BoolArray,
    sigma: float,
    nuisance_covariance: FloatArray,
) -> ImageRows:
    """Return the linear model around a state, LED by LED.

    Parameters
    ----------
    used : (N, C, L) array of bool
    sigma : float
        By which LEDs are weighed, px.
    nuisance_covariance : (N, q, q) array
        As `lightpen.estimation.bundle.linearised.Eliminated` has it.
    """
    n_images, _, n_leds = used.shape
    mixing = unknowns.mixing
    by_leds = mixing[-3 * n_leds :].reshape(n_leds, 3, -1)
    n_fields = views[0].fields.shape[-1]
    at_fields = slice(-3 * n_leds - 1 - n_fields, -3 * n_leds - 1)
    row, turns, cones, common = N_CONE, [], [], []
    for c, view in enumerate(views):
        k = view.own.shape[-1]
        J = (
            np.einsum("nlik,lkp->nlip", view.led, by_leds, optimize=True)
            + view.cone @ mixing[:N_CONE]
            + view.own @ mixing[row : row + k]
            + view.fields @ mixing[at_fields]
            + view.diameter[..., None] * mixing[-3 * n_leds - 1]
        )
        row += k
        shifted = view.cone[..., None, :] * unknowns.forms[:, None, None, :, None]
        mask = used[:, c, :, None, None]
        forms = shifted.reshape(*shifted.shape[:3], -1)
        common.append(np.where(mask, np.concatenate([J, forms], axis=3), 0.0))
        turns.append(np.where(mask, view.turn, 0.0))
        cones.append(np.where(mask, view.cone, 0.0))

    def flat(parts: list[FloatArray]) -> FloatArray:
        rows = np.stack(parts, axis=1) / sigma
        return rows.reshape(n_images, -1, rows.shape[-1])

    T, J = flat(turns), flat(common)
    seen = np.repeat(used.reshape(n_images, -1), 2, axis=1)
    observed = np.stack([view.residuals for view in views], axis=1)
    observed = observed.reshape(n_images, -1)
    if nuisance_covariance.shape[-1] > N_TURN:
        T = np.concatenate([T, flat(cones)], axis=2)
    return ImageRows(
        eliminated=T,
        nuisance_covariance=nuisance_covariance,
        projected=J - T @ (nuisance_covariance @ (np.swapaxes(T, 1, 2) @ J)),
        common=J,
        residuals=np.where(seen, observed, 0.0) / sigma,
        used=seen,
    )
