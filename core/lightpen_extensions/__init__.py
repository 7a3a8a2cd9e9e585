"""Extensions of the program, one package each; they lean on `lightpen` alone."""

from lightpen.catalogue import command_line
from lightpen.messages import TRANSLATED
from lightpen_extensions.catalogue import COMMAND_LINE, MESSAGES

TRANSLATED.update(MESSAGES)
command_line.MESSAGES.update(COMMAND_LINE)
