"""Experiments of `softhand.validation.holding` against their exact answers."""

import pytest

from softhand.validation import holding
from softhand.validation.check import Experiment


@pytest.mark.parametrize("experiment", holding.EXPERIMENTS, ids=lambda experiment: experiment.__name__)
def test_exact(experiment: Experiment) -> None:
    """Every number that the experiment measures is within its tolerance."""
    checks = list(experiment())
    assert checks
    assert [check for check in checks if not check.passed] == []
