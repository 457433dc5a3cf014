"""Following contacts over time: ids that hold, smooth positions, velocities."""
