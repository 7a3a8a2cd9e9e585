"""Verifications on the screen, line by line."""

from dataclasses import replace

import numpy as np

from lightpen.archive.trends import ControlLimits, TipEstimate
from lightpen.detection.reasons import Reason
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import message
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.comparisons.assessment import (
    VERIFY_AGAIN,
    check,
    rule_in_words,
    verification_record,
)
from lightpen_extensions.comparisons.commands.pens import (
    pen_health_entries,
    pen_health_text,
    press_test_text,
)
from lightpen_extensions.comparisons.pen_health import PenHealth, SwingOfPen
from lightpen_extensions.comparisons.press_test import PressTest
from lightpen_extensions.comparisons.repeatability import (
    Repeatability,
    repeatability_entries,
    repeatability_text,
)
from lightpen_extensions.measure.commands.measure import found_text, touches_text
from lightpen_extensions.measure.measuring.report import ResultRow, ResultTable
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint, RejectedFrame
from lightpen_extensions.simulator.swings import PAPER_CONE, PAPER_TIP

RULE = rule_in_words(VerificationLimits())
DOUBT = check(message("drift.too-few"), VERIFY_AGAIN)
VERDICT = ["", f"Verdict      CHECK: {DOUBT.reason}", *(f"{'':13}{each}" for each in
           (DOUBT.next_step, RULE))]  # fmt: skip


def slipped(n: int) -> list[RejectedFrame]:
    return [RejectedFrame(f"{i}.png", Reason.SLIPPED) for i in range(n)]


def named(n: int, more: str = "") -> str:
    names = ", ".join(f"{i}.png ({Reason.SLIPPED})" for i in range(5))
    return f"{n} images left out: {names}{more}"


def test_a_table_of_more_than_ten_columns_is_parted_and_its_names_are_cut() -> None:
    columns = (*map(str, range(11)), "a wide column")
    rows = (
        ResultRow(
            "a name that is cut after so many", [None, "text", *[-1e-6, 2.5] * 5]
        ),
        ResultRow("short", [float(i) for i in range(12)], 0, "remark"),
    )
    note = message("fixed-point.no-nominal-tip")
    table = ResultTable(message("drift.table"), columns, rows, (note,))

    text = found_text([table, ResultTable(note)], DOUBT, slipped(6), RULE)

    values = "".join(f"{x:>10}" for x in ("", "text", *["0.0000", "2.5000"] * 4))
    assert text.splitlines() == [
        str(table.title),
        f"{'':28}" + "".join(f"{i:>10}" for i in range(10)),
        f"a name that is cut after so {values}",
        f"{'short':28}" + "".join(f"{i:>10}" for i in range(10)) + "  remark",
        f"{'':28}{'10':>15}{'a wide column':>15}",
        f"a name that is cut after so {'0.0000':>15}{'2.5000':>15}",
        f"{'short':28}{'10':>15}{'11':>15}  remark",
        *(str(note), str(note), named(6, ", ...")),
        *VERDICT,
    ]
    assert found_text([], DOUBT, slipped(5), RULE).splitlines() == [named(5), *VERDICT]
    assert found_text([], DOUBT, (), RULE).splitlines() == VERDICT


def test_points_stand_beside_their_expanded_uncertainty(instrument: Instrument) -> None:
    shared = np.zeros((3, len(instrument.covariance)))
    noise = np.diag([0.001, 0.002, 0.003]) ** 2
    point = ProbedPoint(PAPER_CONE, noise, shared, np.eye(3), ("first", "last"), 0.1)

    lines = touches_text([point], instrument, slipped(5)).splitlines()

    figures = [*PAPER_CONE, 0.002, 0.004, 0.006]
    assert lines[0] == str(message("table.points"))
    width = len(lines[1][28:]) // 6
    cells = [f"{each:>{width}.4f}" for each in figures]
    assert lines[2] == f"{'first to last':28}{''.join(cells)}"
    assert lines[1].split()[:3] == ["u", "v", "w"]
    assert lines[3:] == ["U has k = 2.", named(5)]


def test_a_press_test_shows_each_change_and_its_uncertainty() -> None:
    change = np.array([0.001, -0.02, 0.003])
    found = PressTest(change, 0.5 * np.abs(change), DOUBT)

    assert press_test_text(found).splitlines() == [
        f"{'Firm less light, mm':24}{'change':>10}{'U':>10}",
        f"{'Tip x':24}{'0.0010':>10}{'0.0005':>10}",
        f"{'Tip y (along pen)':24}{'-0.0200':>10}{'0.0100':>10}",
        f"{'Tip z':24}{'0.0030':>10}{'0.0015':>10}",
        *VERDICT,
    ]
    np.testing.assert_array_equal(found.entries["tip_change_mm"], change)


def test_a_pen_shows_the_move_of_each_led() -> None:
    moved = np.array([[0.0, 0.003, 0.004], [np.nan] * 3])
    swings = (
        SwingOfPen("the name of a swing that is too long", np.zeros((2, 3))),
        SwingOfPen("second", moved),
    )
    found = PenHealth(swings, (1,), DOUBT)

    assert pen_health_text(found).splitlines()[1:] == [
        f"{'Swing':24}{'LED 1':>10}{'LED 2':>10}",
        f"the name of a swing that{'0.000':>10}{'0.000':>10}",
        f"{'second':24}{'0.005':>10}{'-':>10}",
        *VERDICT,
    ]
    entries = pen_health_entries(found)
    assert entries["moved_leds"] == (1,)
    assert [each["name"] for each in entries["swings"]][1:] == ["second"]


def repeated(n_tips: int, *, has_control: bool) -> Repeatability:
    steps = np.where(np.arange(n_tips) % 2, 0.001, -0.001)
    tips = [
        TipEstimate(f"test {i}", PAPER_TIP + step, np.full(3, 0.004))
        for i, step in enumerate(steps)
    ]
    tips[-1] = replace(tips[-1], tip_pen=PAPER_TIP + np.array([0, 0, 0.01]))
    return Repeatability(
        tuple(tips),
        ControlLimits(PAPER_TIP - 0.005, PAPER_TIP, PAPER_TIP + 0.005)
        if has_control
        else None,
        DOUBT,
    )


def test_calibrations_of_a_tip_are_the_first_table_of_the_paper() -> None:
    found = repeated(4, has_control=True)

    def line(name: str, values: np.ndarray, digits: int = 4) -> str:
        return f"{name:24}" + "".join(f"{x:>10.{digits}f}" for x in values)

    values = np.array([tip.tip_pen for tip in found.tips])
    assert repeatability_text(found, RULE).splitlines()[1:] == [
        f"{'No. of test':24}{'x-axis':>10}{'y-axis':>10}{'z-axis':>10}",
        *(line(f"{i:>3} test {i - 1}", each) for i, each in enumerate(values, 1)),
        line("Ave", values.mean(axis=0)),
        line("Std", values.std(axis=0, ddof=1)),
        line("Range", np.ptp(values, axis=0)),
        line("Control limit, lower", PAPER_TIP - 0.005),
        line("Control limit, upper", PAPER_TIP + 0.005),
        "Out of control: test 3",
        *VERDICT,
    ]
    few = repeatability_text(repeated(30, has_control=False), RULE)
    assert "Control limit" not in few
    entries = repeatability_entries(found)
    assert entries["control"]["out_of_control"] == ["test 3"]
    record = verification_record("length", {}, None, {}, {})
    assert (record["verdict"], record["coverage_factor"]) == (None, 2.0)
