"""Tasks of joints: their limits, couplings, mechanisms and posture."""
