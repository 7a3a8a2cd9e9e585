"""Origin of images as a remark beside their results."""

from lightpen.model.origin import Origin
from lightpen_app.look.phrases import origin_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.widgets.sign_label import StatusMessage


def origin_message(origin: Origin | None) -> StatusMessage:
    """Return the remark on images that are not live; empty otherwise."""
    if origin is Origin.LIVE:
        return StatusMessage()
    tone = Tone.ACTIVE if origin is Origin.RECORDED else Tone.WARN
    return StatusMessage(origin_text(origin), Sign.RING, tone)
