"""A URDF as one object: read and checked once, with file, line, element, value and remedy of what is wrong."""
