"""What the controller is asked for, against time."""
