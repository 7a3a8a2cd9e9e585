"""Extensions of the program, one package each; they lean on `lightpen` alone."""

from lightpen.messages import TRANSLATED
from lightpen_extensions.catalogue import MESSAGES

TRANSLATED.update(MESSAGES)
