"""The files of verifications: kept, and read."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from msgspec import Struct, field

from lightpen.errors import FileError
from lightpen.formats.json_records import ProgramName, record_bytes
from lightpen.formats.own_json import (
    DamagedError,
    ZonedTime,
    parse_checked,
    parse_own_json,
    require_usual,
)
from lightpen.formats.stored_messages import StoredMessage
from lightpen.model.origin import Origin
from lightpen.record.folder.outcome import TrialOutcome
from lightpen.record.library.entered_files import add_numbered, entered_files
from lightpen.record.library.signing.keys import SigningKey
from lightpen.record.library.supervision import read_supervision
from lightpen.record.results.result_folder import SIMULATED
from lightpen.record.swings.names import Names

VERIFICATIONS = "verifications"
TOUCHES = "touches"  # in that folder: the images of live points, session by session
CONCLUSION = "conclusion"
VERIFIED = "verified"  # key of the task in the settings of an entry
MEASURED_PART: Final = "part"  # kind of the task that measures a part
BALL_CENTRE = "ball centre"  # of a measured feature: no surface was touched


class _Verdict(StoredMessage, frozen=True, kw_only=True):
    grade: str
    limits_mm: dict[str, float] = field(default_factory=dict)


class StoredImages(Struct, frozen=True):
    """Folder of the images of a session."""

    folder: str
    journal_sha256: str


class _Inputs(Struct, frozen=True):
    touches: tuple[StoredImages, ...] = ()


class StoredVerification(Struct, frozen=True):
    """A verification in a data folder."""

    program: ProgramName
    created: ZonedTime
    verification: str  # kind of the task; "conclusion" for the end of the session
    station: str = ""
    operator: str = ""
    pen: str = ""
    tip: str = ""
    origin: Origin | None = None
    temperature_c: float | None = None  # of the pen; None if not measured
    humidity_percent: float | None = None  # of the room; None if not measured
    camera_serials: tuple[str, ...] = ()  # of the cameras that saw the pen
    verdict: _Verdict | None = None
    ended: TrialOutcome | None = field(name="outcome", default=None)
    reason: str = ""  # conclusion only: why a tip is used that did not pass
    supervisor: str = ""  # conclusion only: who approved that
    inputs: _Inputs = _Inputs()

    def __post_init__(self) -> None:
        require_usual(self.created)

    @property
    def outcome(self) -> TrialOutcome:
        """Outcome of the verification."""
        if self.ended is not None:
            return self.ended
        has_passed = self.verdict is None or self.verdict.grade == "pass"
        return TrialOutcome.ACCEPTED if has_passed else TrialOutcome.REFUSED

    @property
    def why(self) -> StoredMessage | None:
        """Reason of the grade."""
        verdict = self.verdict
        if verdict is None:
            return None
        return StoredMessage(verdict.code, verdict.text, verdict.values)


class _Kind(Struct):
    verification: str = ""


def is_verification(content: bytes) -> bool:
    """Return whether a JSON file says that it is a verification."""
    try:
        return parse_own_json(content, _Kind).verification != ""
    except DamagedError:
        return False


def read_verification(content: bytes, file: Path) -> StoredVerification:
    """Read the file of a verification, approved as it must be in a data folder."""
    try:
        done = parse_checked(content, StoredVerification)
    except DamagedError as error:
        raise FileError("verification.damaged", file=file) from error
    data = data_folder_of_verification(file)
    if data is not None and done.supervisor:
        counted = entered_files(data).counted(file, content)
        if counted is not None:
            counted.require_approved(read_supervision(data).key)
    return done


def attributed(
    record: Mapping[str, Any], names: Names, origin: Origin | None
) -> dict[str, Any]:
    """Return the record of a verification with who made it where, of what."""
    return {
        **record,
        "session": record["created"],
        "station": names.station,
        "operator": names.operator,
        "pen": names.pen,
        "tip": names.tip,
        "origin": origin,
    }


def data_folder_of_verification(file: Path) -> Path | None:
    """Return the data folder that a file is a verification of; None of other files."""
    folder = file.absolute().parent
    if folder.name != VERIFICATIONS:
        return None
    return folder.parents[folder.parent.name == SIMULATED]


def keep_verification(
    data: Path,
    record: Mapping[str, Any],
    supervisor: SigningKey | None = None,
    *,
    is_simulated: bool,
) -> Path:
    """Keep the record of a verification in a data folder, and return its file.

    The supervisor whom it names approves it.
    """
    folder = verifications_folder(data, is_simulated=is_simulated)
    return add_numbered(data, folder, record_bytes(record), supervisor)


def verifications_folder(data: Path, *, is_simulated: bool) -> Path:
    """Return the verifications folder of a data folder."""
    return (data / SIMULATED if is_simulated else data) / VERIFICATIONS


def conditions_entries(
    temperature_c: float | None, humidity_percent: float | None
) -> dict[str, float]:
    """Return the measured environment as entries of a record."""
    conditions = {"temperature_c": temperature_c, "humidity_percent": humidity_percent}
    return {name: each for name, each in conditions.items() if each is not None}
