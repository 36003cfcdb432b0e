"""The headless Chromium in which films are drawn."""
