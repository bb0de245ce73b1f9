"""What is timed and compared: resolvers, the control tick, starts, packages of others."""
