"""What a controller sees, brought up to date."""
