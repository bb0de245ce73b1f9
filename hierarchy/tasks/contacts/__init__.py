"""Tasks of contacts at level "torque": how they move, their forces and their friction."""
