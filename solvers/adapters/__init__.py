"""Our resolvers called in the way of other packages; each file is called after one."""
