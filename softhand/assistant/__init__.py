"""From the URDF of a hand to a scenario that holds an object: tips, object, pose, contacts, squeeze and gains."""
