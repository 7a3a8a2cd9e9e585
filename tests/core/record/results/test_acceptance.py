"""Accepting is one step: killed or refused anywhere, one result is in force."""

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from typing import IO, Any

import numpy as np
import pytest
from benchmarks.small_records import entries_of, small_record
from msgspec import structs
from tests.entering import enter_in, retire_item

from lightpen.arrays import FloatArray
from lightpen.errors import AcceptanceError, FileError
from lightpen.estimation.reports.verdict import Grade, judge
from lightpen.formats.own_json import StoredMessage
from lightpen.messages import Code
from lightpen.model.limits import StationLimits, SwingLimits
from lightpen.model.names import Origin
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.signing import STATION_FILE
from lightpen.record.library.supervision import Signature, set_limits, set_password
from lightpen.record.library.tip_library import (
    ItemKind,
    ListedCone,
    ListedTip,
    library_files,
)
from lightpen.record.results.acceptance import accept, conclude_accepted
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import HEADER, header_bytes, read_header
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import (
    Solution,
    load_image,
    solve_again,
    solve_record,
)
from lightpen.record.swings.writing import RecordWriter, note_excluded
from lightpen_extensions.simulator.swings import swing_poses

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
LATER = NOON + timedelta(hours=1)
LIMITS = SwingLimits(max_uncertainty=1.0, min_images=20)
REASON = "The tip was exchanged."

# Solves the swing in a data folder, then for each line accepts it in another one, which
# has the same swing, in a process of its own: that is killed before a line of the steps
# that it takes, or may write files of so many bytes. It forks, as solving takes time.
PROGRAM = """
import os, resource, signal, sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from lightpen.errors import FileError
from lightpen.record.results.acceptance import accept
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import solve_record

STEPS = {
    *("accept", "revoke", "store", "create_whole", "part_of", "_name_anew"),
    *("sync_folder", "add_numbered", "write_counted", "owe"),
    *("_conclude", "_own_journal", "_write_line", "close"),
}

def die_before(n_lines):
    def trace(frame, event, argument):
        nonlocal n_lines
        if frame.f_code.co_name not in STEPS:
            return None
        if event == "line":
            n_lines -= 1
            if n_lines == 0:
                os.kill(os.getpid(), signal.SIGKILL)
        return trace

    sys.settrace(trace)

def limit(n_bytes):
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, n_bytes))

def run(order, number, data):
    folder = Path(data, "records", "swing")
    swing = replace(solution, source=replace(solution.source, folder=folder))
    takes_back = order == "die taking back"
    {"limit": limit}.get(order, die_before)(int(number))
    try:
        archive, now = FolderArchive(Path(data)), datetime(2026, 1, 2, 13, tzinfo=UTC)
        if takes_back:
            names = open_record(folder).header.names
            archive.revoke(archive.in_force(names.pen, names.tip), "Ann", now)
        else:
            accept(archive, swing, now, "The tip was exchanged.")
    except FileError:
        os._exit(1)
    os._exit(0)

solution = solve_record(open_record(Path(sys.argv[1], "records", "swing")))
print("solved", flush=True)
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        run(*line.rstrip("\\n").split("|"))
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""

forks = pytest.mark.skipif(sys.platform == "win32", reason="needs processes that fork")


@pytest.fixture(scope="module")
def swing(
    swung: Callable[..., Path],
    rewrite_header: Callable[..., None],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """A data folder with a swing whose tip can be accepted; copy it to change it."""
    data = tmp_path_factory.mktemp("accepting") / "data"
    folder = Path(shutil.copytree(swung(), data / RECORDS / "swing"))
    rewrite_header(folder, limits={"max_uncertainty": 1.0}, origin=Origin.LIVE)
    return data


@pytest.fixture(scope="module")
def solved(swing: Path) -> Solution:
    return solve_record(open_record(swing / RECORDS / "swing"))


class Case:
    """A data folder in which a tip of the pen is in force, and its next swing.

    Parameters
    ----------
    swing : Path
        Data folder of the swing.
    solution : Solution
        Of the swing.
    data : Path
        Folder to be made.
    """

    def __init__(self, swing: Path, solution: Solution, data: Path) -> None:
        shutil.copytree(swing, data)
        self.data, self.records = data, data / RECORDS
        self.folder = self.records / "swing"
        self.archive = FolderArchive(data)
        self.names = open_record(self.folder).header.names
        source = replace(solution.source, folder=self.folder)
        self.solution = replace(solution, source=source)
        self.archive.store(
            Result(
                names=self.names,
                accepted=NOON,
                grade=Grade.PASS,
                record=self.records / "earlier",
                images=(1, 2),
                calibration=small_record(
                    {
                        "tip_pen_mm": [1.0, 2.0, 3.0],
                        "expanded_uncertainty_mm": [0.1, 0.1, 0.1],
                        "cone_cam_mm": [1.0, 2.0, 3.0],
                        "covariance": [[0.25] * 6] * 6,
                    }
                ),
            )
        )

    def accept(self, reason: str = REASON) -> Result:
        return accept(self.archive, self.solution, LATER, reason)

    def revoke(self) -> None:
        self.archive.revoke(self.in_force(), "Ben", LATER)

    def in_force(self) -> Result:
        found = self.archive.in_force(self.names.pen, self.names.tip)
        assert found is not None
        return found

    def n_results(self) -> int:
        return len(list(self.archive.folder.glob("*.json")))

    def verdict(self) -> str | None:
        return open_record(self.folder).verdict

    def offered(self) -> list[str]:
        """Names of the swings that are offered at the next start."""
        found = conclude_accepted(self.archive, find_unfinished(self.records))
        assert found.damaged == ()
        return [record.folder.name for record in found.interrupted]


@pytest.fixture
def case(swing: Path, solved: Solution, tmp_path: Path) -> Case:
    return Case(swing, solved, tmp_path / "data")


@pytest.fixture
def elsewhere(swing: Path) -> Iterator[Callable[[str, int, Path], int]]:
    """Return a function that accepts in another process, and gives its exit status."""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(swing)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        orders: IO[str] = process.stdin
        reported: IO[str] = process.stdout
        assert reported.readline() == "solved\n"

        def run(order: str, number: int, data: Path) -> int:
            orders.write(f"{order}|{number}|{data}\n")
            orders.flush()
            return int(reported.readline())

        yield run
        orders.close()


Elsewhere = Callable[[str, int, Path], int]


def test_an_accepted_tip_is_in_force_and_its_swing_concluded(case: Case) -> None:
    result = case.accept()

    found = case.in_force()
    joint = case.solution.calibration.joint
    assert found.tip_pen.tolist() == result.tip_pen.tolist() == joint.tip_pen.tolist()
    assert (found.names, found.accepted, found.grade) == (
        case.names,
        LATER,
        Grade.CHECK,
    )
    assert (found.record, found.images) == (case.folder, tuple(range(1, 21)))
    assert case.verdict() == Grade.CHECK
    assert case.offered() == []


def test_the_result_holds_what_the_command_line_writes_of_the_record(
    case: Case, lightpen: Callable[..., Any], tmp_path: Path
) -> None:
    case.accept()
    file = tmp_path / "calibration.json"
    assert lightpen("calibrate", case.folder, "--json", file).returncode == 0
    written = json.loads(file.read_bytes())

    stored = entries_of(case.in_force().calibration)

    assert stored.pop("created")
    assert written.pop("created")
    assert written.pop("checksum")  # a result has its own
    assert stored == written
    assert {"covariance", "cone_cam_mm", "uncertainty", "frames", "verdict"} < {*stored}
    assert len(stored["inputs"]["observations"]) == 20


def test_a_tip_that_must_be_repeated_is_refused_whatever_the_reason(
    case: Case, rewrite_header: Callable[..., None]
) -> None:
    rewrite_header(case.folder, limits={"max_uncertainty": 1e-9})

    with pytest.raises(AcceptanceError, match="The tip cannot be accepted"):
        case.accept()
    assert case.n_results() == 1
    assert case.verdict() is None


@pytest.mark.parametrize("reason", ["", "  "])
def test_a_tip_that_is_to_be_checked_needs_a_reason(case: Case, reason: str) -> None:
    with pytest.raises(AcceptanceError, match="Enter a reason to accept it"):
        case.accept(reason)
    assert case.n_results() == 1
    assert case.verdict() is None


def test_a_tip_that_passes_needs_no_reason(case: Case) -> None:
    passing = _passing(case)

    assert accept(case.archive, passing, LATER).grade == Grade.PASS
    assert case.in_force().reason == ""
    assert case.in_force().why == StoredMessage.of(
        judge(passing.calibration, LIMITS).reason
    )


def test_a_tip_that_passes_by_itself_is_to_be_checked_where_it_has_moved(
    case: Case,
) -> None:
    passing = _passing(case)
    tip = passing.calibration.joint.tip_pen
    u = passing.calibration.budget.expanded_uncertainty[:3]
    _put_in_force(case, tip - 1.5 * np.hypot(u, u), u)

    with pytest.raises(AcceptanceError, match="Was the tip replaced, bent or refitted"):
        accept(case.archive, passing, LATER)

    result = accept(case.archive, passing, LATER, f" {REASON} ")
    assert (result.grade, result.reason) == (Grade.CHECK, REASON)
    stored = case.in_force()
    assert (stored.grade, stored.reason) == (Grade.CHECK, REASON)
    assert stored.why is not None
    assert stored.why.code == Code.TIP_CHANGED
    assert stored.change is not None
    assert stored.change.accepted == NOON
    np.testing.assert_allclose(
        stored.change.expanded_uncertainty_mm, np.hypot(u, u), rtol=1e-12
    )


def test_a_change_beyond_the_limit_of_the_tip_is_accepted_only_with_a_reason(
    case: Case,
) -> None:
    passing = _passing(case)
    tip = passing.calibration.joint.tip_pen
    u = passing.calibration.budget.expanded_uncertainty[:3]
    _put_in_force(case, tip - 0.9 * np.hypot(u, u), u)  # which U explains
    limit = 0.5 * float(np.linalg.norm(u))
    name = open_record(passing.source.folder).header.names.tip
    data = case.archive.folder.parent
    add_item(data, ListedTip(id=name, max_change_mm=limit), Author(), NOON)

    with pytest.raises(AcceptanceError, match="more than its limit"):
        accept(case.archive, passing, LATER)

    accept(case.archive, passing, LATER, REASON)
    stored = case.in_force()
    assert (stored.grade, stored.reason) == (Grade.CHECK, REASON)
    found = stored.change
    assert found is not None
    assert (found.limit_mm, found.is_within) == (limit, False)
    assert found.distance_mm > limit
    assert found.as_found_mm is not None
    np.testing.assert_allclose(
        np.add(found.as_found_mm, found.difference_mm), stored.tip_pen, rtol=1e-12
    )


def test_an_overdue_cone_is_reported_with_the_result(case: Case) -> None:
    cone = open_record(case.folder).header.names.cone
    data = case.archive.folder.parent
    add_item(data, ListedCone(id=cone, due=date(2020, 1, 1)), Author(), NOON)

    case.accept()
    reported = {doubt.code: doubt.text for doubt in case.in_force().doubts}
    assert reported["doubt.overdue"].startswith(f"The cone {cone} expired on")


# As it is, in small letters, with a Unicode hyphen, a Cyrillic T, a width of its own.
SPELLINGS = ("T-10", "t-10", "T\u201010", "\u0422-10", "\uff34\uff0d\uff11\uff10")


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_a_retired_tip_is_not_put_in_force_however_it_is_typed(
    case: Case, spelling: str
) -> None:
    passing = _passing(case)
    assert open_record(passing.source.folder).header.names.tip == "T-10"
    _retitled(case, spelling)
    data = case.archive.folder.parent
    add_item(data, ListedTip(id="T-10"), Author(), NOON)
    retire_item(data, ItemKind.TIP, "T-10", Author(), NOON)

    with pytest.raises(AcceptanceError, match="is retired and cannot be accepted"):
        accept(case.archive, passing, LATER, REASON)


@pytest.mark.parametrize("is_listed", [True, False])
def test_a_tip_is_accepted_by_the_name_that_is_known(
    case: Case, *, is_listed: bool
) -> None:
    _retitled(case, "\u0422\u201010")
    if is_listed:
        add_item(case.data, ListedTip(id="T-10"), Author(), NOON)
    result = case.accept()
    assert (result.names.tip, case.in_force().accepted) == ("T-10", LATER)
    assert result.change is not None  # it has the earlier one to be compared with


def _retitled(case: Case, tip: str) -> None:
    """Write another spelling of the tip into the header of the swing."""
    header = read_header(case.folder)
    header = structs.replace(header, names=replace(header.names, tip=tip))
    (case.folder / HEADER).write_bytes(header_bytes(header))


def test_a_tip_of_a_damaged_library_is_to_be_checked(case: Case) -> None:
    passing = _passing(case)
    data = case.archive.folder.parent
    add_item(data, ListedTip(id="T-99"), Author(), NOON)
    (file,) = library_files(data)
    file.write_bytes(file.read_bytes().replace(b"T-99", b"T-98"))

    with pytest.raises(AcceptanceError, match=r"library/000001\.json was changed"):
        accept(case.archive, passing, LATER)


def test_what_is_doubtful_besides_is_stored_with_the_result(case: Case) -> None:
    case.accept()
    stored = case.in_force()

    assert stored.why is not None
    assert stored.why.code == Code.TOO_LITTLE_TILT
    assert Code.TIP_CHANGED in {doubt.code for doubt in stored.doubts}
    assert stored.why.code not in {doubt.code for doubt in stored.doubts}


def test_a_tip_that_cannot_be_compared_is_to_be_checked(case: Case) -> None:
    passing = _passing(case)
    newest = max(case.archive.folder.glob("*.json"))
    newest.write_bytes(newest.read_bytes()[:-100])

    with pytest.raises(
        AcceptanceError, match="The tip cannot be compared with the current one"
    ):
        accept(case.archive, passing, LATER)


def test_a_simulated_tip_is_never_in_force_for_a_pen(
    case: Case, rewrite_header: Callable[..., None]
) -> None:
    rewrite_header(case.folder, origin=Origin.SIMULATED)
    result = case.accept()

    assert result.origin is Origin.SIMULATED
    assert case.in_force().accepted == NOON
    names = case.names
    practised = case.archive.in_force(names.pen, names.tip, is_simulated=True)
    assert practised is not None
    assert (practised.origin, practised.record) == (Origin.SIMULATED, case.folder)
    assert case.offered() == []


def test_what_is_taken_back_is_kept_and_the_tip_before_in_force_again(
    case: Case,
) -> None:
    before = [path.read_bytes() for path in case.archive.folder.glob("*.json")]
    case.accept()
    case.revoke()

    assert case.in_force().accepted == NOON
    assert case.n_results() == 3
    kept = [path.read_bytes() for path in case.archive.folder.glob("*.json")]
    assert set(before) < set(kept)
    newest = json.loads(max(case.archive.folder.glob("*.json")).read_bytes())
    assert (newest["takes_back"], newest["names"]["operator"]) == ("000002", "Ben")


def test_what_was_taken_back_can_be_accepted_again_and_taken_back_again(
    case: Case,
) -> None:
    for _ in range(2):
        case.accept()
        assert case.in_force().record == case.folder
        case.revoke()
        assert case.in_force().accepted == NOON
    case.revoke()

    assert case.archive.in_force(case.names.pen, case.names.tip) is None
    assert case.n_results() == 6


def test_only_what_is_in_force_can_be_taken_back(case: Case) -> None:
    first = case.in_force()
    case.accept()

    with pytest.raises(FileError, match="is no longer current"):
        case.archive.revoke(first, "Ben", LATER)
    assert case.in_force().record == case.folder


def _passing(case: Case) -> Solution:
    """Put the swing's own tip in force, and let the pen have leant to all sides."""
    calibration = case.solution.calibration
    u = calibration.budget.expanded_uncertainty[:3]
    _put_in_force(case, calibration.joint.tip_pen, u)
    rotations = swing_poses(150, np.random.default_rng(0)).rotations
    joint = replace(calibration.joint, rotations=rotations)
    return replace(case.solution, calibration=replace(calibration, joint=joint))


def _put_in_force(case: Case, tip: FloatArray, u: FloatArray) -> None:
    """Put a tip in force in place of the first one."""
    shutil.rmtree(case.archive.folder)
    names = replace(case.names)
    calibration = small_record(
        {"tip_pen_mm": tip.tolist(), "expanded_uncertainty_mm": u.tolist()}
    )
    earlier = case.records / "earlier"
    case.archive.store(
        Result(
            names=names,
            accepted=NOON,
            grade=Grade.PASS,
            record=earlier,
            images=(1, 2),
            calibration=calibration,
        )
    )


def test_a_swing_accepted_twice_has_one_result(case: Case) -> None:
    first = case.accept()
    length = open_record(case.folder).length
    again = case.accept()

    assert again.accepted == first.accepted
    assert case.n_results() == 2
    assert open_record(case.folder).length == length


def test_other_images_of_a_swing_are_another_result(case: Case) -> None:
    case.accept()
    note_excluded(case.folder, {3: "taken out"})
    case.solution = solve_again(case.solution, {3: "taken out"})
    case.accept()

    assert case.n_results() == 3
    assert case.in_force().images == (1, 2, *range(4, 21))
    frames = case.in_force().calibration.frames
    assert [frame.reason for frame in frames[:4]] == ["", "", "taken out", ""]


def test_a_swing_that_has_changed_since_it_was_solved_is_refused(case: Case) -> None:
    note_excluded(case.folder, {3: "taken out"})

    with pytest.raises(FileError, match="changed after the tip was computed"):
        case.accept()
    assert case.n_results() == 1
    assert case.offered() == ["swing"]


def test_a_swing_that_another_program_writes_to_is_refused(
    case: Case, holding: Callable[[Path], "subprocess.Popen[str]"]
) -> None:
    holding(case.folder)

    with pytest.raises(FileError, match="Another program is writing"):
        case.accept()
    assert case.n_results() == 1


def test_images_captured_after_the_acceptance_are_offered(case: Case) -> None:
    case.accept()
    record = open_record(case.folder)
    first = record.images[0]
    with RecordWriter.resume(record) as writer:
        image = load_image(case.solution, 1)
        pose = np.array(first.rotation), np.array(first.translation)
        writer.append(image, first.rig_pixels[0], *pose, 9.0)

    assert case.offered() == ["swing"]


def test_a_damaged_result_of_a_swing_is_accepted_anew(case: Case) -> None:
    case.accept()
    newest = max(case.archive.folder.glob("*.json"))
    newest.write_bytes(newest.read_bytes()[:-100])
    case.accept()

    assert case.n_results() == 3
    assert case.in_force().record == case.folder


@pytest.mark.slow
@forks
def test_killed_before_any_line_it_leaves_the_old_tip_or_the_new_and_no_doubt(
    swing: Path, solved: Solution, elsewhere: Elsewhere, tmp_path: Path
) -> None:
    met = set[tuple[bool, bool]]()
    status, number = -signal.SIGKILL, 0
    while status == -signal.SIGKILL:
        number += 1
        case = Case(swing, solved, tmp_path / str(number))
        status = elsewhere("die", number, case.data)
        is_new = case.in_force().record == case.folder
        met.add((is_new, case.verdict() is not None))

        assert case.n_results() == 1 + is_new
        assert case.offered() == ([] if is_new else ["swing"])
        assert (case.verdict() == Grade.CHECK) is is_new
        case.accept()
        assert case.in_force().record == case.folder
        assert case.n_results() == 2
        shutil.rmtree(case.data)

    assert status == 0
    assert number > 50
    assert met == {(False, False), (True, False), (True, True)}


@pytest.mark.slow
@forks
def test_killed_while_it_is_taken_back_the_tip_is_in_force_or_the_one_before(
    swing: Path, solved: Solution, elsewhere: Elsewhere, tmp_path: Path
) -> None:
    case = Case(swing, solved, tmp_path / "accepted")
    case.accept()
    met = set[bool]()
    status, number = -signal.SIGKILL, 0
    while status == -signal.SIGKILL:
        number += 1
        data = tmp_path / str(number)
        shutil.copytree(case.data / "results", data / "results")
        shutil.copy(case.data / STATION_FILE, data)
        shutil.copytree(case.folder, data / RECORDS / "swing")
        status = elsewhere("die taking back", number, data)
        found = FolderArchive(data).in_force(case.names.pen, case.names.tip)
        assert found is not None
        is_back = found.accepted == NOON
        met.add(is_back)

        assert is_back or found.accepted == LATER
        assert len(list((data / "results").glob("*.json"))) == 2 + is_back
        shutil.rmtree(data)

    assert status == 0
    assert number > 10
    assert met == {False, True}


@pytest.mark.slow
@forks
def test_a_full_disk_keeps_the_old_tip_and_the_next_attempt_succeeds(
    case: Case, elsewhere: Elsewhere
) -> None:
    assert elsewhere("limit", 1000, case.data) == 1
    assert case.in_force().accepted == NOON
    assert case.offered() == ["swing"]
    assert case.n_results() == 1

    assert elsewhere("limit", 10_000_000, case.data) == 0
    assert case.in_force().record == case.folder
    assert case.verdict() == Grade.CHECK


@pytest.mark.slow
@forks
def test_a_journal_that_cannot_be_written_is_concluded_at_the_next_start(
    case: Case, elsewhere: Elsewhere
) -> None:
    with RecordWriter.resume(open_record(case.folder)) as writer:
        for _ in range(50):  # until the journal is longer than the result
            writer.exclude(range(1000, 2000), "taken out")
            writer.set_excluded({})
    journal = open_record(case.folder).length

    assert elsewhere("limit", journal, case.data) == 0
    assert case.in_force().record == case.folder
    assert case.verdict() is None

    assert case.offered() == []
    assert case.verdict() == Grade.CHECK


def test_an_accepted_swing_is_not_offered_though_it_cannot_be_concluded(
    case: Case, holding: Callable[[Path], "subprocess.Popen[str]"]
) -> None:
    images = tuple(range(1, 21))
    case.archive.store(replace(case.in_force(), record=case.folder, images=images))
    found = find_unfinished(case.records)
    holding(case.folder)

    assert len(found.interrupted) == 1
    assert conclude_accepted(case.archive, found).interrupted == ()
    assert case.verdict() is None


EVE = Signature("Eve", "correct horse")


@pytest.fixture
def guarded(swing: Path, solved: Solution, tmp_path: Path) -> tuple[Path, Solution]:
    """A copy of the swing whose U is beyond the limits that a supervisor has set.

    The header of the swing says that it is far within.
    """
    data = Path(shutil.copytree(swing, tmp_path / "data"))
    folder = data / RECORDS / "swing"
    own = replace(solved, source=replace(solved.source, folder=folder))
    largest = own.calibration.budget.weakest_uncertainty
    limits = StationLimits(replace(LIMITS, max_uncertainty=0.9 * largest))
    set_password(data, EVE, EVE.password, NOON)
    set_limits(data, "Hall 2", limits, EVE, NOON)
    return data, own


def named(folder: Path, station: str) -> None:
    """Write another station into the header of a swing, with its checksum."""
    header = read_header(folder)
    header = structs.replace(header, names=replace(header.names, station=station))
    (folder / HEADER).write_bytes(header_bytes(header))


@pytest.mark.slow
@pytest.mark.parametrize("station", ["Hall 2", "hall 2 ", "HALL 2"])
def test_the_limits_in_force_count_and_not_those_of_the_header(
    guarded: tuple[Path, Solution], station: str
) -> None:
    data, own = guarded
    named(own.source.folder, station)
    archive = FolderArchive(data)
    with pytest.raises(AcceptanceError, match="outside the limits of this station"):
        accept(archive, own, LATER, REASON)
    with pytest.raises(AcceptanceError, match="Wrong"):
        accept(archive, own, LATER, REASON, replace(EVE, password="no"))

    result = accept(archive, own, LATER, REASON, EVE)
    assert (result.supervisor, result.grade) == ("Eve", Grade.CHECK)
    stored = archive.in_force(result.names.pen, result.names.tip)
    assert stored is not None
    assert stored.supervisor == "Eve"


def test_a_station_without_limits_needs_the_supervisor(
    guarded: tuple[Path, Solution],
) -> None:
    data, own = guarded
    named(own.source.folder, "Hall 22")
    with pytest.raises(AcceptanceError, match="Hall 22 has no limits"):
        accept(FolderArchive(data), own, LATER, REASON)
    assert accept(FolderArchive(data), own, LATER, REASON, EVE).supervisor == "Eve"


def test_nothing_is_accepted_once_the_limits_were_removed(
    guarded: tuple[Path, Solution],
) -> None:
    data, own = guarded
    enter_in(data)
    shutil.rmtree(data / "limits")
    with pytest.raises(FileError, match="Nothing is accepted"):
        accept(FolderArchive(data), own, LATER, REASON)
    assert FolderArchive(data).folder.exists() is False
