"""Experiments of `softhand.validation.motion` against their exact answers."""

import pytest

from softhand.validation import motion
from softhand.validation.check import Experiment


@pytest.mark.parametrize("experiment", motion.EXPERIMENTS, ids=lambda experiment: experiment.__name__)
def test_exact(experiment: Experiment) -> None:
    """Every number that the experiment measures is within its tolerance."""
    checks = list(experiment())
    assert checks
    assert [check for check in checks if not check.passed] == []
