"""Score (gradient of the likelihood) of each view, to compare groups of views."""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class ViewScores:
    """Scores (gradients) of the views for all parameters but poses and effects."""

    scores: FloatArray  # (V, s)
    information: FloatArray  # (V, q, s), columns of the information matrix of each view
    # (q, q), of these parameters and the effects of board and lens, by all views.
    covariance: FloatArray

    def change(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return score (s,) and information (s, s) of a change by shares (V,)."""
        score = weights @ self.scores
        first = np.einsum("v,vqs->qs", weights, self.information)
        own = np.einsum("v,vqs->qs", weights**2, self.information)
        n = len(score)
        known = own[:n] - first.T @ self.covariance @ first
        return score, 0.5 * (known + known.T)

    def without(
        self, weights: FloatArray, at: slice, difference: FloatArray
    ) -> "ViewScores":
        """Return the scores of views after a change in which they have a share.

        Parameters
        ----------
        weights : (V,) array
            The share.
        at : slice
            Indices of the changed parameters.
        difference : array
            Of these.
        """
        moved = weights[:, None] * (self.information[..., at] @ difference)
        drawn = self.covariance @ moved.sum(axis=0)
        n = self.scores.shape[1]
        left = self.scores - moved[:, :n]
        left += np.einsum("vqs,q->vs", self.information, drawn)
        return replace(self, scores=left)

    @property
    def clustering(self) -> float:
        """Scatter of the scores over its expectation by the components."""
        n = self.scores.shape[1]
        S = self.covariance[:n, :n]
        found = np.einsum("vi,ij,vj->", self.scores, S, self.scores)
        own = self.information[:, :n]
        leverage = np.einsum(
            "vqi,qr,vrj->ij",
            self.information,
            self.covariance,
            self.information,
            optimize=True,
        )
        return float(found / np.sum(S * (own.sum(axis=0) - leverage)))
