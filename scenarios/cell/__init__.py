"""What a scenario file describes, put together: robot, tasks, sensor and plant."""
