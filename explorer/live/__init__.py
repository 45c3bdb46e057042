"""The live pour: a solver process, the messages to and from it, and the frames that it leaves in shared memory."""
