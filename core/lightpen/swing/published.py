"""What is known of a swing: its status as published last, presence and faults."""

from dataclasses import replace

from lightpen.runners.faults import FaultReporter
from lightpen.swing.capture.state import SwingEvent
from lightpen.swing.operator_presence import OperatorPresence
from lightpen.swing.status import SwingListener, SwingStatus, log_change


class PublishedSwing:
    """Holds the status for the parts of the workflow, and notifies."""

    def __init__(self, listener: SwingListener) -> None:
        self._listener = listener
        self.faults = FaultReporter(listener)
        self.status = SwingStatus()
        self.presence = OperatorPresence()

    def publish(self, status: SwingStatus, *events: SwingEvent) -> None:
        """Set the status and notify."""
        is_open = status.is_capturing or (status.has_verdict and not status.result)
        before = self.status
        self.status = replace(
            status,
            refusal=self.presence.refusal,
            has_other_choices=is_open and self.presence.has_other_choices,
        )
        log_change(before, self.status, events)
        self._listener.on_swing(self.status, events)

    def republish(self) -> None:
        """Notify, after the presence has changed."""
        self.publish(self.status)
