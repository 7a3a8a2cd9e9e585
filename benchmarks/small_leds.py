"""LEDs of 4 to 20 px on panels: how many are flagged, and how their centres scatter."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from benchmarks.peers import gaussian_fits, grey_centroids_at
from benchmarks.rows import Row, numbers
from benchmarks.workers import Workers
from tests.simulated_panels import Panel, panel_image

from lightpen.arrays import FloatArray, Image
from lightpen.detection.spots import SpotFlaw, detect_spots

WIDTHS = (4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 14.0, 20.0)
REAL_WIDTHS = (5.0, 6.0, 7.0)  # of the LEDs whose flags are limited
N_IMAGES = 3
SEED = 11
START_NOISE = 0.2  # px, of the places that others start from
MAX_FLAGGED = 0.1
MARGIN = 1.15  # of a scatter over the least of others: 200 LEDs tell it to 5 %

_dark = Panel(6.0, reflections=(0.0, 0.0), bloom=0.0, quality=None)
_lit = Panel(6.0)
LOOKS = {
    "in the dark": _dark,
    "on a board": _lit,
    "on a shining board": Panel(
        6.0, reflections=(0.1, 0.5), bloom=0.3, background=0.08, quality=80
    ),
    "with halos of their own": Panel(
        6.0,
        reflections=(0.05, 0.2),
        bloom=0.15,
        background=0.05,
        quality=None,
        pitch=4.0,
        halos=(0.1, 0.4),
        variety=0.3,
    ),
    "clipped, on a board": replace(_lit, gains=(2.0, 6.0)),
}


@dataclass(frozen=True)
class _Outcome:
    """Of one look and width; scatters per image coordinate, px."""

    found: float
    flagged: float
    own: float
    others: dict[str, float]


def small_led_rows(workers: Workers) -> list[Row]:
    """Return flagged shares and scatters of each look."""
    cases = [(look, width) for look in LOOKS for width in WIDTHS]
    outcomes = dict(zip(cases, workers.map(_outcome, cases), strict=True))
    rows = []
    for look in LOOKS:
        of_width = {width: outcomes[look, width] for width in WIDTHS}
        flagged = max(of_width[width].flagged for width in REAL_WIDTHS)
        rows.append(
            Row(
                f"LEDs of {REAL_WIDTHS[0]:g} to {REAL_WIDTHS[-1]:g} px {look}: "
                "most flagged, clipping apart; least found",
                f"{100 * flagged:.0f} %; "
                f"{100 * min(of_width[w].found for w in REAL_WIDTHS):.0f} %",
                f"<= {100 * MAX_FLAGGED:.0f} %",
                met=flagged <= MAX_FLAGGED,
            )
        )
        names = list(next(iter(of_width.values())).others)
        rows.append(
            Row(
                f"LEDs of {' '.join(f'{w:g}' for w in WIDTHS)} px {look}: "
                "scatter of centres",
                f"{numbers((each.own for each in of_width.values()), 3)} px",
                f"<= {MARGIN:g} times the best of others",
                "; ".join(
                    f"{name} "
                    + numbers((each.others[name] for each in of_width.values()), 3)
                    for name in names
                ),
                all(
                    each.own <= MARGIN * min(each.others.values())
                    for each in of_width.values()
                ),
            )
        )
    return rows


def _outcome(case: tuple[str, float]) -> _Outcome:
    look, width = case
    panel = replace(LOOKS[look], width=width)
    rng = np.random.default_rng(SEED)
    methods: dict[str, Callable[[Image, FloatArray], FloatArray]] = {
        "grey centroid": partial(grey_centroids_at, width=width),
        "Gaussian fit": partial(gaussian_fits, width=width, blur=panel.psf),
    }
    errors: dict[str, list[FloatArray]] = {name: [] for name in ("own", *methods)}
    flaws, n_leds = [], 0
    for _ in range(N_IMAGES):
        shown = panel_image(panel, rng)
        spots = detect_spots(shown.image)
        gaps = np.linalg.norm(spots.centers - shown.centers[:, None], axis=2)
        near = gaps.min(axis=1) < width / 2 + 1
        which = gaps.argmin(axis=1)[near]
        flaws.append(spots.flaws[which])
        n_leds += len(shown.centers)
        errors["own"].append(spots.centers[which] - shown.centers[near])
        starts = shown.centers + rng.normal(0, START_NOISE, shown.centers.shape)
        for name, method in methods.items():
            errors[name].append(method(shown.image, starts) - shown.centers)
    every = np.concatenate(flaws)
    unclipped = every[(every & SpotFlaw.SATURATED) == 0]
    return _Outcome(
        found=len(every) / n_leds,
        flagged=float(np.mean(unclipped > 0)) if len(unclipped) else 0.0,
        own=_rms(errors["own"]),
        others={name: _rms(errors[name]) for name in methods},
    )


def _rms(errors: list[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
