"""A solved swing for use elsewhere."""

import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from lightpen.model.names import Origin
from lightpen.record.exports import (
    TABLE_FORMATS,
    copied_tip,
    export_stem,
    exported_solution,
    save_new,
)
from lightpen.record.swings.header import Names
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import solve_record


@pytest.mark.parametrize(
    ("names", "origin", "stem"),
    [
        (Names(pen="LP-04", tip="T-10"), Origin.LIVE, "LP-04_T-10_2026-01-02"),
        (Names(pen="a/b", tip="../x"), None, "a-b_..-x_2026-01-02"),
        (Names(), Origin.SIMULATED, "2026-01-02_SIMULATED"),
        (Names(pen="A"), Origin.RECORDED, "A_2026-01-02_RECORDED"),
    ],
)
def test_files_are_named_by_pen_tip_date_and_what_is_not_live(
    names: Names, origin: Origin | None, stem: str
) -> None:
    assert export_stem(names, datetime(2026, 1, 2, tzinfo=UTC), origin) == stem


def test_no_file_is_written_over(tmp_path: Path) -> None:
    saved = [save_new(tmp_path, "a.csv", data) for data in (b"1", b"2", b"3")]

    assert [path.name for path in saved] == ["a.csv", "a-2.csv", "a-3.csv"]
    assert [path.read_bytes() for path in saved] == [b"1", b"2", b"3"]


def test_a_copied_tip_is_marked_where_it_is_not_live() -> None:
    tip = np.array([-1.5, -90.25, -23.875])

    copied = "-1.5\t-90.25\t-23.875"
    assert copied_tip(tip, Origin.LIVE) == copied
    assert copied_tip(tip, Origin.RECORDED) == f"{copied}\tRECORDED"


def test_a_solved_swing_is_exported_as_the_command_line_records_it(
    swung: Callable[..., Path], lightpen: Callable[..., object], tmp_path: Path
) -> None:
    solution = solve_record(open_record(swung()))
    exported = exported_solution(solution, Names(pen="LP-04", tip="T-10"))
    out = tmp_path / "y.json"
    lightpen("calibrate", solution.source.folder, "--json", out)

    (form,) = [each for each in TABLE_FORMATS if each.name == "json"]
    saved = json.loads(form.content(exported))
    printed = json.loads(out.read_bytes())
    for each in (saved, printed):
        del each["created"], each["checksum"]
    assert saved == printed
    assert (exported.names.pen, exported.origin) == ("LP-04", Origin.SIMULATED)
    tip = solution.calibration.joint.tip_pen
    np.testing.assert_array_equal(exported.calibration.tip_pen_mm, tip)
