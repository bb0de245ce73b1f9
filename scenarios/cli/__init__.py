"""The command line, `hierarchy`: one module a command or group of them."""
