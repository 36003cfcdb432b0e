"""From a scenario to a simulation."""
