"""What the files of verifications say of who verified what, and what it came to."""

from pathlib import Path

from msgspec import Struct, field

from lightpen.errors import FileError
from lightpen.formats.files import printable
from lightpen.formats.own_json import (
    DamagedError,
    Moment,
    parse_checked,
    require_usual,
)
from lightpen.model.origin import Origin
from lightpen.record.camera_calibrations import ProgramName
from lightpen.record.outcome import TrialOutcome
from lightpen.record.results import Why
from lightpen.sentences import sentence

VERIFICATIONS = "verifications"
TOUCHES = "touches"  # in that folder: the images of live touches, run by run
UNDER_WAY = "under way"  # likewise: what is not concluded yet
CONCLUSION = "conclusion"


class _Verdict(Struct, frozen=True):
    grade: str
    code: str = ""
    text: str = ""
    limits_mm: dict[str, float] = {}


class KeptTouchRun(Struct, frozen=True):
    """Where the images of a run of live touches are kept, in the folder of touches."""

    folder: str
    journal_sha256: str


class _Inputs(Struct, frozen=True):
    touches: tuple[KeptTouchRun, ...] = ()


class KeptVerification(Struct, frozen=True):
    """A verification in a data folder.

    Attributes
    ----------
    verification : str
        What was verified; "conclusion" of what says how all of it ended.
    ended : TrialOutcome or None
        Of a conclusion.
    reason, supervisor : str
        Of a conclusion, where a tip is used though it did not pass.
    """

    program: ProgramName
    created: Moment
    verification: str
    station: str = ""
    operator: str = ""
    pen: str = ""
    tip: str = ""
    origin: Origin | None = None
    verdict: _Verdict | None = None
    ended: TrialOutcome | None = field(name="outcome", default=None)
    reason: str = ""
    supervisor: str = ""
    inputs: _Inputs = _Inputs()

    def __post_init__(self) -> None:
        require_usual(self.created)

    @property
    def outcome(self) -> TrialOutcome:
        """What became of it."""
        if self.ended is not None:
            return self.ended
        has_passed = self.verdict is None or self.verdict.grade == "pass"
        return TrialOutcome.ACCEPTED if has_passed else TrialOutcome.REFUSED

    @property
    def why(self) -> Why | None:
        """What its grade is for."""
        verdict = self.verdict
        return Why(verdict.code, verdict.text) if verdict and verdict.code else None


def read_verification(content: bytes, file: Path) -> KeptVerification:
    """Return what the file of a verification says.

    Raises
    ------
    FileError
        It is damaged.
    """
    try:
        return parse_checked(content, KeptVerification)
    except DamagedError as error:
        raise FileError(
            sentence(
                "verification.damaged",
                "The verification in {file} is not as it was written: it was changed "
                "or damaged since. Restore the file from a copy.",
                file=printable(str(file)),
            )
        ) from error
