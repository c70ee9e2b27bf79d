"""The encoding of a text, told from its first bytes: nothing states it but a mark that few programs write."""

from __future__ import annotations

import re

_HIGH = re.compile(rb"[\x80-\xff]{3,}")
_RUSSIAN = re.compile("[А-ЯЁ]+|[А-ЯЁа-яё][а-яё]+")
_WIDE_WORD = re.compile("[\u3040-\u30ff\u4e00-\u9fff]{2}")
_NO_SIGN = re.compile(rb"[\x81\x8d\x8f\x90\x9d]")
"""Bytes that stand for nothing in Windows-1252, and begin signs of Shift-JIS, as of ℃."""


def encoding_of(head: bytes, cut: bool) -> str:
    """The likeliest encoding of a text: UTF-8, Windows-1251, GB 18030 or Shift-JIS, else Latin-1.

    Told from its first bytes, `cut` where it goes on.
    """
    for end in range(4 if cut else 1):
        # The last character of a cut head may be incomplete.
        if _decoded(head[: len(head) - end], "utf-8") is not None:
            return "utf-8-sig"
    whole = head[: (head.rfind(b"\n") + 1 if cut else 0) or len(head)]
    if _is_russian(whole):
        return "cp1251"
    # Both bytes of a Chinese sign are above 0xA0; the degree sign of Latin-1 stands before a plain letter.
    if _decoded(whole, "gb2312") is not None:
        return "gb18030"
    japanese = _decoded(whole, "cp932")
    if japanese is not None and (_NO_SIGN.search(whole) or _WIDE_WORD.search(japanese)):
        return "cp932"
    return "latin-1"


def _decoded(content: bytes, encoding: str) -> str | None:
    try:
        return content.decode(encoding)
    except UnicodeDecodeError:
        return None


def _is_russian(content: bytes) -> bool:
    """Whether words of letters beyond ASCII are Russian ones, some of small letters but for the first.

    Chinese has signs among them, or capitals alone, if read so; in Western languages no three such letters
    follow one another.
    """
    words = [word.decode("cp1251", errors="replace") for word in _HIGH.findall(content)]
    return any(word[1:].islower() for word in words) and all(map(_RUSSIAN.fullmatch, words))
