"""What images are of, as a remark that stands beside all that comes of them."""

from lightpen.model.origin import Origin
from lightpen_app.look.phrases import origin_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.widgets.sign_label import StatusMessage


def origin_message(origin: Origin | None) -> StatusMessage:
    """Return the word for images that are not of a live camera; nothing for those."""
    if origin is Origin.LIVE:
        return StatusMessage()
    tone = Tone.ACTIVE if origin is Origin.RECORDED else Tone.WARN
    return StatusMessage(origin_text(origin), Sign.RING, tone)
