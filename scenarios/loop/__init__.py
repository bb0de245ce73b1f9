"""The control loop: one tick, a whole run, its recording, and injected faults."""
