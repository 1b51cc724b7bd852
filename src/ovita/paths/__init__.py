"""What a trajectory is, where it lies, and how two of them compare: numpy only, in the sandbox too."""
