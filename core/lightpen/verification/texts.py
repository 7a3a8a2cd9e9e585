"""Verifications as text for the screen, in the tables of the paper.

[1] S. Liu et al., "Portable light pen 3D vision coordinate measuring system - probe tip
center calibration", Measurement Science Review 13 (2013) 194-199, tables 1 to 3.
"""

from collections.abc import Callable, Sequence

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.instrument import Instrument
from lightpen.estimation.uncertainty import COVERAGE_FACTOR
from lightpen.verification.articulation import Articulation
from lightpen.verification.assessment import Conformity
from lightpen.verification.circle import Circle
from lightpen.verification.drift import Drift
from lightpen.verification.fixed_point import FixedPoint
from lightpen.verification.led_file import ImprovedPen
from lightpen.verification.length import Length
from lightpen.verification.pen_health import PenHealth
from lightpen.verification.repeatability import (
    CAPABLE,
    STUDY,
    Capability,
    Repeatability,
)
from lightpen.verification.touch import RejectedFrame, Touch

MOST_COLUMNS = 10  # runs beside each other
MOST_NAMED = 5  # images
TITLE, COLUMN = 24, 10  # characters


def fixed_point_text(found: FixedPoint, rejected: Sequence[RejectedFrame]) -> str:
    """Return a fixed point as text: the paper's Table 2."""
    both = [found.calibrated, *([] if found.nominal is None else [found.nominal])]
    titles = ("Calibrated tip", "Nominal tip")
    width = 3 * COLUMN + 2
    lines = [
        "Fixed point in the camera frame, mm",
        f"{'':<{TITLE}}"
        + "".join(f"{title:>{width}}" for title in titles[: len(both)]),
        f"{'No.':<{TITLE}}"
        + ("  " + "".join(f"{axis:>{COLUMN}}" for axis in "uvw")) * len(both),
    ]

    def row(title: str, values: Sequence[FloatArray]) -> str:
        cells = ("  " + "".join(f"{x:{COLUMN}.4f}" for x in each) for each in values)
        return f"{title:<{TITLE}}" + "".join(cells)

    for i, touch in enumerate(found.touches):
        name = f"{i + 1:>3} {touch.label}"
        lines.append(row(name[:TITLE], [scatter.points[i] for scatter in both]))
    lines += [
        row("Ave", [scatter.mean for scatter in both]),
        row("Std", [scatter.deviation for scatter in both]),
        row("Range", [scatter.range for scatter in both]),
        row("U (k = 2) of Ave", [found.uncertainty]),
        row("Std expected", [found.expected_deviation]),
    ]
    if found.moved is not None:
        lines.append(row("Ave less the cone", [found.moved]))
    if found.nominal is None:
        lines.append("No nominal tip is given to compare with.")
    lines += [
        row("Tip wanted less given", [found.tip_change]) + "  (x y z of the pen)",
        row("  U (k = 2)", [found.tip_change_uncertainty]),
        *_left_out(rejected),
    ]
    return "\n".join([*lines, "", *_verdict(found.assessment)])


def circle_text(found: Circle, rejected: Sequence[RejectedFrame]) -> str:
    """Return a circle as text: the paper's Table 3."""
    errors = found.errors
    rows = (
        ("Computed value", found.radii, 4),
        ("Absolute error", errors, 4),
        ("Relative error (x 1e-4)", errors / found.certified * 1e4, 2),
        ("U (k = 2)", np.array([run.uncertainty for run in found.runs]), 4),
        ("Roundness", np.array([run.fit.roundness for run in found.runs]), 4),
        ("Off the plane", np.array([run.fit.flatness for run in found.runs]), 4),
        ("Covered, degrees", np.array([run.fit.covered for run in found.runs]), 0),
        ("Touches", np.array([len(run.touches) for run in found.runs]), 0),
    )
    lines = [f"Radius, mm; certified {found.certified:.4f}"]
    n_runs = len(found.runs)
    for first in range(0, n_runs, MOST_COLUMNS):
        own = slice(first, min(first + MOST_COLUMNS, n_runs))
        ends = own.stop == n_runs and n_runs > 1
        head = [str(i + 1) for i in range(own.start, own.stop)]
        head += ["Average"] * ends
        lines.append(
            f"{'No. of test':<{TITLE}}" + "".join(f"{each:>{COLUMN}}" for each in head)
        )
        for title, values, digits in rows:
            shown = [*values[own], *([values.mean()] if ends else [])]
            lines.append(
                f"{title:<{TITLE}}"
                + "".join(f"{value:{COLUMN}.{digits}f}" for value in shown)
            )
    if found.deviation is not None:
        lines.append(f"{'Std of the radii':<{TITLE}}{found.deviation:{COLUMN}.4f}")
    lines.append(f"{'U (k = 2) of Average':<{TITLE}}{found.uncertainty:{COLUMN}.4f}")
    lines += [f"{i + 1:>3} {run.name}" for i, run in enumerate(found.runs)]
    lines += _left_out(rejected)
    return "\n".join([*lines, "", *_verdict(found.assessment)])


def length_text(found: Length, rejected: Sequence[RejectedFrame]) -> str:
    """Return a known length as text."""
    head = ("measured", "error", "U (k = 2)", "touches")
    lines = [
        f"Length, mm; certified {found.certified:.4f}, U (k = 2) "
        f"{found.certified_uncertainty:.4f}",
        f"{'Place':<{TITLE}}" + "".join(f"{each:>{COLUMN}}" for each in head),
    ]
    for run, error, uncertainty in zip(
        found.runs, found.errors, found.uncertainties, strict=True
    ):
        n_touches = len(run.ends[0]) + len(run.ends[1])
        cells = "".join(f"{x:{COLUMN}.4f}" for x in (run.measured, error, uncertainty))
        lines.append(f"{run.name[:TITLE]:<{TITLE}}{cells}{n_touches:{COLUMN}d}")
    scale = found.scale
    lines += [
        f"{'Scale of the pen':<{TITLE}}{scale.factor:{COLUMN}.6f}, U (k = 2) "
        f"{1e6 * scale.uncertainty:.1f} ppm, without the length "
        f"{1e6 * scale.uncertainty_before:.1f} ppm",
        *_left_out(rejected),
    ]
    return "\n".join([*lines, "", *_verdict(found.assessment)])


def touches_text(
    touches: Sequence[Touch],
    instrument: Instrument,
    rejected: Sequence[RejectedFrame],
) -> str:
    """Return points with their uncertainty as text."""
    lines = [
        "Points in the camera frame, mm",
        f"{'Touch':<{TITLE}}"
        + "".join(f"{each:>{COLUMN}}" for each in (*"uvw", "U u", "U v", "U w")),
    ]
    for touch in touches:
        spread = np.sqrt(np.diag(touch.covariance(instrument)))
        values = (*touch.point_cam, *(COVERAGE_FACTOR * spread))
        cells = "".join(f"{x:{COLUMN}.4f}" for x in values)
        lines.append(f"{touch.label[:TITLE]:<{TITLE}}{cells}")
    lines.append("U has k = 2.")
    return "\n".join([*lines, *_left_out(rejected)])


def articulation_text(found: Articulation, rejected: Sequence[RejectedFrame]) -> str:
    """Return an articulated location error as text."""
    head = ("u", "v", "w", "spread")
    lines = [
        "Location error in the form of ISO 10360-12, mm",
        f"{'Posture':<{TITLE}}" + "".join(f"{each:>{COLUMN}}" for each in head),
    ]
    for name, location, spread in zip(
        found.names, found.locations, found.spreads, strict=True
    ):
        cells = "".join(f"{x:{COLUMN}.4f}" for x in (*location, spread))
        lines.append(f"{name[:TITLE]:<{TITLE}}{cells}")
    lines += [
        f"{'Location error':<{TITLE}}{found.location_error:{COLUMN}.4f}",
        f"{'  expected':<{TITLE}}{found.expected:{COLUMN}.4f}",
        *_left_out(rejected),
    ]
    return "\n".join([*lines, "", *_verdict(found.assessment)])


def _left_out(rejected: Sequence[RejectedFrame]) -> list[str]:
    if not rejected:
        return []
    named = ", ".join(f"{each.name} ({each.reason})" for each in rejected[:MOST_NAMED])
    more = ", ..." if len(rejected) > MOST_NAMED else ""
    return [f"{len(rejected)} images left out: {named}{more}"]


def _verdict(assessment: Conformity) -> list[str]:
    return [
        f"Verdict      {assessment.grade.upper()}: {assessment.reason}",
        f"             {assessment.next_step}",
    ]


def repeatability_text(found: Repeatability) -> str:
    """Return calibrations of one tip as text: the paper's Table 1."""

    def row(title: str, values: FloatArray, digits: int = 4) -> str:
        return f"{title:<{TITLE}}" + "".join(f"{x:{COLUMN}.{digits}f}" for x in values)

    lines = [
        "Center coordinates of the probe tip, mm",
        f"{'No. of test':<{TITLE}}"
        + "".join(f"{axis + '-axis':>{COLUMN}}" for axis in "xyz"),
        *(
            row(f"{i + 1:>3} {tip.name}"[:TITLE], tip.tip_pen)
            for i, tip in enumerate(found.tips)
        ),
        row("Ave", found.scatter.mean),
        row("Std", found.scatter.deviation),
        row("Range", found.scatter.range),
        row("Control limit, lower", found.control.lower),
        row("Control limit, upper", found.control.upper),
    ]
    out = found.out_of_control
    if out:
        lines.append("Out of control: " + ", ".join(tip.name for tip in out))
    if found.touched is not None:
        lines += [
            row("Std of a fixed point", found.touched.deviation) + "  (u v w)",
            row("  expected", found.touched.expected_deviation),
        ]
    if found.capability is not None:
        lines += _capability_lines(found.capability, len(found.tips), row)
    return "\n".join([*lines, "", *_verdict(found.assessment)])


def _capability_lines(
    found: Capability, n_tips: int, row: Callable[[str, FloatArray, int], str]
) -> list[str]:
    lines = [
        f"Type-1 gauge study, tolerance {found.tolerance:g} mm wide, {n_tips} repeats"
        + (f" (a study takes {STUDY} to 50)" if n_tips < STUDY else ""),
        row("Cg", found.cg, 2),
    ]
    if found.cgk is not None:
        lines.append(row("Cgk", found.cgk, 2))
    capable = "capable" if found.is_capable else "not capable"
    lines.append(f"{capable.capitalize()} (all {CAPABLE} or more are asked for)")
    return lines


def pen_health_text(found: PenHealth) -> str:
    """Return a pen over its swings as text."""
    n_leds = len(found.swings[0].shifts)
    lines = [
        "LEDs since the first swing, mm, and size of the pen, ppm",
        f"{'Swing':<{TITLE}}"
        + "".join(f"{f'LED {j + 1}':>{COLUMN}}" for j in range(n_leds))
        + f"{'size':>{COLUMN}}",
    ]
    for swing in found.swings:
        lengths = np.linalg.norm(swing.shifts, axis=1)
        cells = "".join(
            f"{x:{COLUMN}.3f}" if np.isfinite(x) else f"{'-':>{COLUMN}}"
            for x in lengths
        )
        size = "-" if swing.growth is None else f"{1e6 * swing.growth:+.0f}"
        lines.append(f"{swing.name[:TITLE]:<{TITLE}}{cells}{size:>{COLUMN}}")
    return "\n".join([*lines, "", *_verdict(found.assessment)])


def improved_pen_text(found: ImprovedPen) -> str:
    """Return the new places of the LEDs of a pen as text."""
    pen = found.pen
    lines = [
        "LEDs of the pen, mm: new, and new less old",
        f"{'LED':<5}" + "".join(f"{axis:>{COLUMN}}" for axis in ("x", "y", "z") * 2),
    ]
    for j, (place, move) in enumerate(zip(pen.leds, found.moves, strict=True)):
        cells = "".join(f"{x:{COLUMN}.4f}" for x in (*place, *move))
        lines.append(f"{j + 1:<5}{cells}")
    lines += [
        f"A coordinate is known to {pen.led_sigma:.5f} mm, the scale to "
        f"{1e6 * (pen.scale_sigma or 0.0):.1f} ppm (k = 1), by "
        + ", ".join(found.pooled)
        + ".",
        f"{found.held_out} confirms it: residuals of {found.sigma_after:.4f} px, "
        f"{found.sigma_before:.4f} px with the old file.",
    ]
    return "\n".join(lines)


def drift_text(found: Drift, rejected: Sequence[RejectedFrame]) -> str:
    """Return a witness visited several times as text."""
    lines = [
        "Witness since the first visit, camera frame, mm",
        f"{'Visit':<{TITLE}}" + "".join(f"{axis:>{COLUMN}}" for axis in "uvw"),
    ]
    for name, move, uncertainty in zip(
        found.names, found.moves, found.uncertainties, strict=True
    ):
        for title, values in ((name[:TITLE], move), ("  U (k = 2)", uncertainty)):
            cells = "".join(f"{x:{COLUMN}.4f}" for x in values)
            lines.append(f"{title:<{TITLE}}{cells}")
    share = "".join(f"{x:{COLUMN}.4f}" for x in found.share)
    lines += [f"{'Share of u (k = 1)':<{TITLE}}{share}", *_left_out(rejected)]
    return "\n".join([*lines, "", *_verdict(found.assessment)])
