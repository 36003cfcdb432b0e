"""What a grasp holds: how hard it must squeeze, how near slip is, and the worst push that it survives."""
