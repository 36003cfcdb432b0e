"""How good a grasp is, where it may be, and which others there are."""
