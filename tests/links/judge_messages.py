"""Builds the messages of MoveIt, of ros2_control and of Nav2 that no package index has, for the judges of tests/links.

judge_messages.py PREFIX     the virtual environment with a distribution's wheels, run by ovita's own Python

Only what the tests talk about is built, with the generators of the wheels (cmake and a C++ compiler, 3 minutes each).
Of FollowPath there are the fields of the goal as Nav2 has them since Jazzy, and of its result the error code.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from ovita.io.messages import MOVEIT

TOLERANCES = "[] path_tolerance|[] component_path_tolerance|[] goal_tolerance|[] component_goal_tolerance".split("|")
POINTS = "\n".join(
    [f"trajectory_msgs/JointTrajectoryPoint {name}" for name in ("desired", "actual", "error")]
    + ["string[] multi_dof_joint_names"]
    + [f"trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_{name}" for name in ("desired", "actual", "error")]
)
OTHERS = {
    "control_msgs/msg/JointTolerance": "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration",
    "control_msgs/msg/JointComponentTolerance": "uint16 X_AXIS=1\nstring joint_name\nuint16 component\n"
    "float64 position\nfloat64 velocity\nfloat64 acceleration",
    "control_msgs/action/FollowJointTrajectory": "\n".join(
        [
            "trajectory_msgs/JointTrajectory trajectory\ntrajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory",
            *(f"Joint{'Component' if 'component' in rest else ''}Tolerance{rest}" for rest in TOLERANCES),
            "builtin_interfaces/Duration goal_time_tolerance\n---\nint32 error_code\nstring error_string\n---",
            "std_msgs/Header header\nstring[] joint_names",
            POINTS,
        ]
    ),
    "nav2_msgs/action/FollowPath": "nav_msgs/Path path\nstring controller_id\nstring goal_checker_id\n"
    "string progress_checker_id\n---\nuint16 error_code\n---\nfloat32 distance_to_goal\nfloat32 speed",
}
BUILT_WITH = (r"/opt/python/[^;\"]*/include/python[0-9.]+", r"/opt/python/[^;\"]*/numpy/[^;\"]*")
ORDER = ("control_msgs", "nav2_msgs", "object_recognition_msgs", "moveit_msgs")

CMAKE = """cmake_minimum_required(VERSION 3.8)
project({package})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{find}
rosidl_generate_interfaces({package} {files} DEPENDENCIES {needs})
ament_package()
"""
SHARED = 'set(ament_cmake_ros_FOUND TRUE)\noption(BUILD_SHARED_LIBS "" ON)\n'
"""In place of ament_cmake_ros, which is on the index without what it needs for tests."""

XML = """<package format="3"><name>{package}</name><version>0.0.0</version><description>for tests</description>
<maintainer email="nobody@example.org">nobody</maintainer><license>BSD</license>
<buildtool_depend>ament_cmake</buildtool_depend><buildtool_depend>rosidl_default_generators</buildtool_depend>
{needs}<member_of_group>rosidl_interface_packages</member_of_group></package>
"""


def written(folder, package):
    """The sources of a package: its definitions, CMakeLists.txt and package.xml."""
    files, needs = [], {"builtin_interfaces"}
    for name, text in (MOVEIT | OTHERS).items():
        owner, part, kind = name.split("/")
        if owner == package:
            file = folder / part / f"{kind}.{part}"
            file.parent.mkdir(exist_ok=True)
            file.write_text(text + "\n")
            files.append(f"{part}/{file.name}")
            needs |= set(re.findall(r"^(\w+)/", text, re.MULTILINE)) - {package}
    ordered = sorted(needs)
    find = "\n".join(f"find_package({need} REQUIRED)" for need in ordered)
    listed = {"files": " ".join(files), "needs": " ".join(ordered)}
    (folder / "Findament_cmake_ros.cmake").write_text(SHARED)
    (folder / "CMakeLists.txt").write_text(CMAKE.format(package=package, find=find, **listed))
    depends = "".join(f"<depend>{need}</depend>" for need in [*ordered, "action_msgs"])
    (folder / "package.xml").write_text(XML.format(package=package, needs=depends))


def built(package, prefix):
    """Build a package and install it into the prefix."""
    found = {name: f"{prefix}" for name in ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH")}
    paths = {"PATH": f"{prefix / 'bin'}:{os.environ['PATH']}", "LD_LIBRARY_PATH": str(prefix / "lib")}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        written(folder, package)
        chosen = [f"-DCMAKE_INSTALL_PREFIX={prefix}", f"-DPython3_EXECUTABLE={prefix / 'bin' / 'python'}"]
        chosen += ["-DBUILD_TESTING=OFF", f"-DCMAKE_MODULE_PATH={name}"]
        for command in (
            ["cmake", "-S", name, "-B", f"{name}/b", *chosen],
            ["cmake", "--build", f"{name}/b", "--target", "install"],
        ):
            done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **found, **paths})
            if done.returncode:
                sys.exit(f"{package}: {' '.join(command)} failed\n{done.stdout[-2000:]}{done.stderr[-4000:]}")


def at_home(prefix):
    """The wheels' own build files name the Python that they were built with; let them name the one that is here."""
    ask = "import numpy, sysconfig; print(sysconfig.get_path('include')); print(numpy.get_include())"
    here = subprocess.check_output([prefix / "bin" / "python", "-c", ask], text=True).split()
    for file in prefix.glob("share/*/cmake/*Export.cmake"):
        text = old = file.read_text()
        for pattern, path in zip(BUILT_WITH, here, strict=True):
            text = re.sub(pattern, path, text)
        if text != old:
            file.write_text(text)


if __name__ == "__main__":
    at_home(Path(sys.argv[1]).resolve())
    for one in ORDER:
        built(one, Path(sys.argv[1]).resolve())
        print("built", one, flush=True)
