"""Verifications by command are entered in the archive of the tip's data folder."""

import json
import shutil
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from subprocess import CompletedProcess
from typing import TypeAlias

import numpy as np
import pytest
from tests.accepted_tip import accept_tip
from tests.entering import entries_of
from tests.simulated_centers import simulate_centers

from lightpen.archive.chains import Event, chain_at_home
from lightpen.archive.store import look_into
from lightpen.formats.camera_files import read_camera
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.formats.pen_files import read_pen
from lightpen.model.limits import StationLimits, VerificationLimits
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.supervision import Signature, save_limits
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import Preparation
from lightpen_extensions.simulator.swings import PAPER_TIP, swing_poses

Run: TypeAlias = Callable[..., CompletedProcess[str]]
Verify: TypeAlias = Callable[..., CompletedProcess[str]]

N_POINTS = 12


@pytest.fixture
def preparation(shared_data: Path) -> Preparation:
    """Names and files of a tip."""
    files = shared_data / "fixed-point"
    return Preparation(
        names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0),
        camera_file=CameraFile.read(files / "camera.yaml"),
        pen_file=PenFile.read(files / "leds.csv"),
    )


@pytest.fixture
def result(tmp_path: Path, preparation: Preparation) -> Path:
    """An accepted tip in a data folder."""
    return accept_tip(tmp_path / "data", preparation)


@pytest.fixture
def verify(lightpen: Run, result: Path, shared_data: Path, tmp_path: Path) -> Verify:
    """Return a function that verifies that tip, moved along x, mm, in a cone."""
    camera, pen = (
        shared_data / "fixed-point" / each for each in ("camera.yaml", "leds.csv")
    )

    def run(
        *options: str | Path, tip: Path = result, moved: float = 0.0
    ) -> CompletedProcess[str]:
        rng = np.random.default_rng(1)
        true_tip = PAPER_TIP + np.array([moved, 0, 0])
        model = read_camera(camera), read_pen(pen)
        swing = swing_poses(
            N_POINTS, rng, camera=model[0], pen=model[1], tip_pen=true_tip
        )
        poses = swing.rotations, swing.translations
        lines = ["frame,led,x_px,y_px"]
        for i, image in enumerate(simulate_centers(*model, *poses, 0.01, rng), 1):
            lines += [f"{i},{k},{x},{y}" for k, (x, y) in enumerate(image, 1)]
        centers = tmp_path / "touches.csv"
        centers.write_text("\n".join(lines), encoding="utf-8")
        words = ("--centers", centers, "--camera", camera, "--pen", pen, "--tip", tip)
        return lightpen("verify", "fixed-point", *words, *options)

    return run


def entered(data: Path) -> list[Event]:
    with closing(look_into(data / ARCHIVE)) as database:
        chain = chain_at_home(database)
        assert chain is not None
        return [each.entry.event for each in entries_of(database, chain)]


def test_a_verification_of_an_accepted_tip_is_entered_beside_it(
    verify: Verify, lightpen: Run, tmp_path: Path
) -> None:
    outcome = verify("--json", tmp_path / "point.json")

    assert outcome.returncode == 0, outcome.stderr
    assert "Entered in the archive: " in outcome.stdout
    data = tmp_path / "data"
    accepted, verified = entered(data)
    assert (accepted.kind, verified.kind) == ("accepted", "verification")
    assert verified.names == Names("Hall 2", "Ann", "LP-04", "T-10")
    assert (verified.origin, verified.grade) == ("simulated", "pass")
    assert verified.outcome == "accepted"
    assert verified.settings["verified"] == "fixed point"
    kept = data / "simulated" / "verifications" / "000001.json"
    assert kept.read_bytes() == (tmp_path / "point.json").read_bytes()
    checked = lightpen("archive", "check", "--data", data)
    assert "No change was found: 2 entries, 2 files." in checked.stdout


def test_images_of_the_calibration_verify_no_tip(
    verify: Verify, lightpen: Run, shared_data: Path, tmp_path: Path
) -> None:
    verify()  # writes the LED centres
    own, files = tmp_path / "own.json", shared_data / "fixed-point"
    centers = ("--centers", tmp_path / "touches.csv", "--json", own)
    pen = ("--camera", files / "camera.yaml", "--pen", files / "leds.csv")
    assert lightpen("calibrate", *centers, *pen).returncode == 0

    outcome = verify("--exit-by-verdict", tip=own)

    assert outcome.returncode == 4
    text = "CHECK: Files that were used to calibrate the tip cannot verify it: 1 of"
    assert text in " ".join(outcome.stdout.split())


def test_a_verification_that_fails_is_entered_as_refused(
    verify: Verify, tmp_path: Path
) -> None:
    verify(moved=0.3)

    last = entered(tmp_path / "data")[-1]
    assert (last.outcome, last.grade) == ("refused", "repeat")


def test_what_is_not_to_be_entered_says_so(
    verify: Verify, result: Path, tmp_path: Path
) -> None:
    assert "not entered" in verify("--no-entry").stdout
    outside = Path(shutil.copy(result, tmp_path / "tip.json"))
    assert "not entered" in verify(tip=outside).stdout
    assert not list(tmp_path.rglob("verifications"))


def test_a_tip_from_elsewhere_is_entered_where_it_is_wanted(
    verify: Verify, result: Path, tmp_path: Path
) -> None:
    outside = Path(shutil.copy(result, tmp_path / "tip.json"))
    outcome = verify("--data", tmp_path / "data", tip=outside)

    assert outcome.returncode == 0, outcome.stderr
    assert entered(tmp_path / "data")[-1].settings["verified"] == "fixed point"


def test_a_calibration_given_twice_is_refused(
    lightpen: Run, result: Path, tmp_path: Path
) -> None:
    again = Path(shutil.copy(result, tmp_path / "again.json"))
    outcome = lightpen("repeatability", result, again)

    assert outcome.returncode == 2
    assert "again.json hold the same tip to the last digit" in outcome.stderr


def test_repeatability_is_entered_with_the_tips_it_is_of(
    lightpen: Run, result: Path, preparation: Preparation, tmp_path: Path
) -> None:
    other = accept_tip(tmp_path / "data", preparation, seed=4)
    outcome = lightpen("repeatability", result, other)

    assert outcome.returncode == 0, outcome.stderr
    last = entered(tmp_path / "data")[-1]
    assert last.settings["verified"] == "repeatability"
    content = json.loads(
        (tmp_path / "data/simulated/verifications/000001.json").read_bytes()
    )
    assert [each["file"] for each in content["inputs"]["files"]] == [
        *(result.name, other.name)
    ]


@pytest.mark.slow
def test_options_never_widen_the_limits_of_a_guarded_station(
    verify: Verify, tmp_path: Path
) -> None:
    data, eve = tmp_path / "data", Signature("Eve", "a long password")
    now = datetime(2031, 5, 1, tzinfo=UTC)
    own = StationLimits(verification=VerificationLimits(tip=0.02, risk=4.0))
    save_limits(data, "Hall 2", own, eve, "", now)

    for wider in (
        ("--limit-tip", "9"),
        ("--limit-tip", "0.021"),
        ("--limit-across", "1"),
        ("--decision-rule", "risk"),
        ("--max-risk", "50"),
    ):
        outcome = verify(*wider, moved=0.03)
        assert outcome.returncode == 2, wider
        assert "for this station" in outcome.stderr
    assert not list(data.rglob("verifications/*.json"))

    verify("--limit-tip", "0.01", "--decision-rule", "guard-band")
    verify(moved=0.03)
    narrow, usual = (e for e in entered(data) if e.kind == "verification")
    assert narrow.settings["max_tip_mm"] == 0.01
    assert usual.settings["max_tip_mm"] == 0.02
    assert usual.outcome == "refused"
