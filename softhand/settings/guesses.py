"""Wrong names: which right ones they may have meant."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import SequenceMatcher

_LONGEST = 100  # letters of a name that is looked at
_ALIKE = 0.6  # share of letters from which two names look alike
_WITHIN = 0.1  # what is less alike than the best by more is not told
_MOST = 3


def did_you_mean(word: str, names: Iterable[str]) -> str:
    """The names that a wrong one may have meant, as the end of a message: `; did you mean 'a' or 'b'?`, or nothing."""
    return as_question(meant(word, names))


def as_question(found: Sequence[str]) -> str:
    """Names that may be meant, as the end of a message."""
    return f"; did you mean {' or '.join(map(repr, found))}?" if found else ""


def meant(word: str, names: Iterable[str]) -> list[str]:
    """Up to three names that look like the word, or that begin with it or contain it, the likeliest first.

    Names that begin with an underscore are asked for by programs, notebooks for instance, and mean nothing here.
    """
    if word.startswith("_") or len(word) > _LONGEST:
        return []
    scores = {name: _likeness(word, name) for name in names}
    best = max(scores.values(), default=0.0)
    found = [name for name, score in scores.items() if score >= max(_ALIKE, best - _WITHIN)]
    return sorted(found, key=lambda name: -scores[name])[:_MOST]


def _likeness(word: str, name: str) -> float:
    a, b = word.lower(), name.lower()
    score = SequenceMatcher(None, a, b).ratio()
    shorter, longer = sorted((a, b), key=len)
    if len(shorter) > 2 and shorter in longer:
        score = max(score, _ALIKE - 0.2) + 0.2
    return score - (0.05 if word[:1].isupper() != name.rpartition(".")[2][:1].isupper() else 0.0)
