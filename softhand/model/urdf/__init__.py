"""What a URDF must be before Pinocchio sees it: pure Python, with file, line, element, value and remedy."""
