"""The error of the interface: something that the user asked for cannot be done."""


class CommandError(ValueError):
    """A request that cannot be carried out; the message is one line naming the thing and what is allowed."""
