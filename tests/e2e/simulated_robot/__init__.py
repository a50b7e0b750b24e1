"""A package, so that pytest ends its robot and its observer with its last test and not with the session."""
