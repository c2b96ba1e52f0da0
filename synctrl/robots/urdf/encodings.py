"""In which encoding an XML file is: as its mark says, or else its declaration, or else UTF-8."""

from __future__ import annotations

import codecs
import re

from ...errors import RobotError

ENCODINGS = ("utf-8", "ascii", "iso8859-1", "cp1252", "gb2312", "gbk", "gb18030")
"""What may be declared, as Python calls it. UTF-16 needs a mark: without it the order of bytes is a guess."""

_DECLARED = re.compile(rb"""<\?xml[^>]*?\sencoding\s*=\s*["']([\w.:-]{1,40})["']""", re.ASCII)
_EXPECTED = "expected text in UTF-8, or in the encoding that it declares"


def as_utf8(file: str, data: bytes) -> bytes:
    """The content of an XML file in UTF-8, whatever it declares.

    Args:
        file: what messages call it.
        data: its content.

    Raises:
        RobotError: an encoding that is not read here, a byte that is not in it, or a zero character, as there
            are in UTF-16 without a mark.
    """
    encoding = _encoding(file, data)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        found = f"byte {data[error.start]:#04x}, which is none of {encoding}"
        raise RobotError(f"{_EXPECTED}, found {found}", file=file, line=line, found=found) from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        found = "a zero character, as in UTF-16 without a mark"
        raise RobotError(f"{_EXPECTED}, found {found}", file=file, line=line, found=found)
    return text.encode()


def _encoding(file: str, data: bytes) -> str:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    declared = _DECLARED.match(data.removeprefix(codecs.BOM_UTF8))
    name = declared[1].decode() if declared else "utf-8"
    try:
        encoding = codecs.lookup(name).name
    except LookupError:
        encoding = ""
    if encoding not in ENCODINGS:
        found = f"a declaration of {name!a}"
        raise RobotError(f"{_EXPECTED}, found {found}", file=file, line=1, found=found)
    return encoding
