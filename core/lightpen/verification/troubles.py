"""What could not be done, told until its cause is gone."""

from enum import Enum, auto

from lightpen.sentences import Sentence
from lightpen.verification.status import VerificationListener


class Cause(Enum):
    """What a trouble comes of, where it can end by itself."""

    OTHER = auto()
    IMAGES = auto()  # of touches cannot be kept
    NOTE = auto()  # what it takes to go on cannot be kept


class Troubles:
    """Tells one trouble at a time, and when it is over."""

    def __init__(self, listener: VerificationListener) -> None:
        self._listener = listener
        self._told: Sentence | None = None
        self._cause = Cause.OTHER

    @property
    def is_any(self) -> bool:
        """Whether one is told and not over."""
        return self._told is not None

    def tell(self, trouble: Sentence, cause: Cause = Cause.OTHER) -> None:
        """Tell a trouble in place of the one before."""
        self._told, self._cause = trouble, cause
        self._listener.on_trouble(trouble)

    def end(self) -> None:
        """Tell that the trouble is over, whatever it came of."""
        told, self._told = self._told, None
        if told is not None:
            self._listener.on_relief(told)

    def end_of(self, cause: Cause) -> None:
        """Tell that the trouble is over, if it came of this."""
        if self._cause is cause:
            self.end()
