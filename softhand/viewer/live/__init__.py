"""The picture while it happens, or a replay, in the browser."""
