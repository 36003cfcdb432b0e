"""What any picture of a grasp shows, as plain arrays."""
