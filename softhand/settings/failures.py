"""What went wrong in code of somebody else, in words: the exception, the file and the line."""

from __future__ import annotations

import sysconfig
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from softhand.errors import ScenarioError, SofthandError

_LONGEST = 300
_LIBRARIES = (str(Path(__file__).parents[1]), *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")))


def failure(error: BaseException, file: str | Path = "", line: int = 0) -> str:
    """The exception in one line, with the innermost line of a file that it went through.

    Args:
        error: what was raised.
        file: whose lines are meant; those of no library if not given.
        line: what to name if it went through none of them; 0 for no line.
    """
    places = [(frame.filename, frame.lineno or 0) for frame in traceback.extract_tb(error.__traceback__)]
    if isinstance(error, SyntaxError) and error.filename:
        places.append((error.filename, error.lineno or 0))
    text = error.msg if isinstance(error, SyntaxError) else " ".join(str(error).split())
    shown = text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."
    own = [place for place in places if (place[0] == str(file) if file else not place[0].startswith(_LIBRARIES))]
    name, number = own[-1] if own else (str(file), line)
    where = f" ({name}, line {number})" if name and number else ""
    return f"{type(error).__name__}{f': {shown}' if shown else ''}{where}"


@contextmanager
def blaming(what: str, key: str) -> Iterator[None]:
    """ScenarioError for what is raised inside by somebody's code, other than on purpose.

    Args:
        what: whose code it is, such as `stepper 'Leapfrog'`.
        key: of the scenario that chose it.
    """
    try:
        yield
    except (SofthandError, FloatingPointError):
        raise
    except Exception as error:
        raise ScenarioError(f"{what} raised {failure(error)}; mend it.", key=key, value=what) from error
