"""The command line, `hierarchy`: one module per command or group."""
