"""Control laws: observation in, joint torques out."""
