"""The loop: observe, control, record, step."""
