"""Experiments of `softhand.validation.flow` against their exact answers."""

import pytest

from softhand.validation import flow
from softhand.validation.check import Experiment


@pytest.mark.parametrize("experiment", flow.EXPERIMENTS, ids=lambda experiment: experiment.__name__)
def test_exact(experiment: Experiment) -> None:
    """Every number that the experiment measures is within its tolerance."""
    checks = list(experiment())
    assert checks
    assert [check for check in checks if not check.passed] == []
