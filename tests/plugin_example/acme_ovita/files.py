"""A file format, `.acme`: a line "x y z speed" for each waypoint."""

from ovita import Task, Trajectory


def parse(content, file):
    """The task of a file's text."""
    return Task(Trajectory.from_array([[float(n) for n in line.split()] for line in content.splitlines()]), path=file)


def dumps(trajectory, scene):
    """The text of a file."""
    return "".join(" ".join(f"{n:g}" for n in row) + "\n" for row in trajectory.to_array())
