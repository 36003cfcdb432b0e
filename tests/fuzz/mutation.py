"""Seeded mutations of texts and bytes."""

from __future__ import annotations

import random
import re

NUMBERS = (
    "nan", "inf", "-inf", "0", "-0.0", "-1", "1e308", "-1e308", "1e-308", "1e400", "1e15", "1e-15", "-1e9", "0.1", "3",
    "90", "1e6", "1_0", "0x10", "9" * 60, "1.", ".", "1,5", "true",
)  # fmt: skip
WORDS = (
    "", "x", "true", "[]", "{}", "é", "\0", "\x1b[2J", "../x", "a" * 3000, "/dev/zero", "/proc/self/mem", "[/red]",
    "package://softhand/urdf/box.urdf", "link", "base", "<", '"', "&lol;", "\n[a]\n", "#", "[[", "]]",
)  # fmt: skip
_NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(r"[A-Za-z_]{2,}")
_LONGEST = 2_000_000  # letters


def mutated_text(rng: random.Random, text: str, most: int = 3) -> str:
    """A text with a few things in it changed."""
    for _ in range(rng.randint(1, most)):
        text = rng.choice(_OF_TEXT)(rng, text)[:_LONGEST]
    return text


def mutated_bytes(rng: random.Random, data: bytes) -> bytes:
    """Bytes changed, cut off, moved or repeated."""
    changed = bytearray(data)
    for _ in range(rng.choice([1, 3, 20, 200])):
        changed[rng.randrange(len(changed))] = rng.choice([0, 1, 127, 128, 255, rng.randrange(256)])
    if rng.random() < 0.2:
        del changed[rng.randrange(len(changed)) :]
    if rng.random() < 0.2:
        start, place = rng.randrange(len(changed) or 1), rng.randrange(len(changed) or 1)
        changed[place:place] = changed[start : start + rng.randrange(1, 4096)]
    return bytes(changed)


def _number(rng: random.Random, text: str) -> str:
    return _replaced(rng, text, _NUMBER, rng.choice(NUMBERS))


def _word(rng: random.Random, text: str) -> str:
    others = _WORD.findall(text) or [""]
    return _replaced(rng, text, _WORD, rng.choice([*WORDS, *(rng.choice(others) for _ in WORDS)]))


def _replaced(rng: random.Random, text: str, what: re.Pattern[str], by: str) -> str:
    found = list(what.finditer(text))
    if not found:
        return text + by
    start, end = rng.choice(found).span()
    return text[:start] + by + text[end:]


def _letters(rng: random.Random, text: str) -> str:
    start = rng.randint(0, len(text))
    put = rng.choice([*WORDS, *NUMBERS, chr(rng.randrange(1, 0x3000))])
    return text[:start] + put + text[start + rng.choice([0, 1, 9]) :]


def _line(rng: random.Random, text: str) -> str:
    lines = text.split("\n")
    k, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            del lines[k]
        case 1:
            lines.insert(j, lines[k])
        case 2:
            lines[k], lines[j] = lines[j], lines[k]
        case _:
            lines[k:k] = [lines[k]] * rng.choice([2, 50, 3000])
    return "\n".join(lines)


def _cut(rng: random.Random, text: str) -> str:
    start = rng.randint(0, len(text))
    return text[:start] if rng.random() < 0.3 else text[:start] + text[start + rng.randint(1, 200) :]


def _repeated(rng: random.Random, text: str) -> str:
    start = rng.randint(0, len(text))
    piece = text[start : start + rng.randint(1, 30)]
    return text[:start] + piece * rng.choice([2, 10, 1000, 20000]) + text[start:]


_OF_TEXT = (_number, _number, _number, _word, _word, _letters, _line, _line, _cut, _repeated)
