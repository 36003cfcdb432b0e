"""Checked settings, and plain words for what is wrong with one."""
