"""Faults, reported until they are cleared."""

import logging
from collections.abc import Callable
from enum import Enum
from typing import Protocol

from lightpen.errors import LightpenError
from lightpen.messages import Message

_logger = logging.getLogger(__name__)


class FaultListener(Protocol):
    """Listener to faults; must return quickly."""

    def on_fault(self, message: Message) -> None:
        """Receive a fault as a message to be shown."""

    def on_fault_cleared(self, message: Message) -> None:
        """Receive the end of a fault."""


class FaultReporter:
    """Reports one fault at a time, and its end.

    A fault that can end automatically has a cause, a value of a type of its owner.
    """

    def __init__(self, listener: FaultListener) -> None:
        self._listener = listener
        self._fault: Message | None = None
        self._cause: Enum | None = None

    @property
    def is_any(self) -> bool:
        """Whether a fault is active."""
        return self._fault is not None

    def trying(self, act: Callable[[], object]) -> None:
        """Run a function; if it fails, report the fault and keep the state."""
        try:
            act()
        except LightpenError as error:
            self.report(error.message)

    def report(self, fault: Message, cause: Enum | None = None) -> None:
        """Report a fault in place of the one before."""
        self._fault, self._cause = fault, cause
        _logger.warning("fault raised: %s: %s", fault.code, fault)
        self._listener.on_fault(fault)

    def end(self) -> None:
        """Clear the fault, whatever its cause."""
        fault, self._fault = self._fault, None
        if fault is not None:
            _logger.info("fault cleared: %s", fault.code)
            self._listener.on_fault_cleared(fault)

    def end_of(self, cause: Enum) -> None:
        """State that the fault is over, if this was its cause."""
        if self._cause is cause:
            self.end()
