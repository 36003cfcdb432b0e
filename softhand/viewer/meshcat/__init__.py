"""The same scene in meshcat, beside whatever else is shown there."""
