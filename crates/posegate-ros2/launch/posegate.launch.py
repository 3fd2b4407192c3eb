"""Start posegate-node: ros2 launch posegate.launch.py table:=/path/dock.posegate params:=/path/posegate.yaml

The program `posegate-node` must be on the search path. It is started as a plain process, so this file works without a ROS package that
is built.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("table", description="table of the task, made by `posegate table build`"),
            DeclareLaunchArgument("namespace", default_value="/", description="namespace of the robot, such as /robot1"),
            DeclareLaunchArgument("params", description="parameter file, such as posegate.yaml next to this file"),
            DeclareLaunchArgument("task_digest", description="task digest of the table (`posegate table info` prints it)"),
            DeclareLaunchArgument("pose", default_value="amcl_pose", description="topic of the pose with covariance"),
            DeclareLaunchArgument("odom", default_value="odom", description="topic of the odometry"),
            ExecuteProcess(
                cmd=[
                    "posegate-node",
                    LaunchConfiguration("table"),
                    "--task-digest",
                    LaunchConfiguration("task_digest"),
                    "--ros-args",
                    "--params-file",
                    LaunchConfiguration("params"),
                    "-r",
                    ["__ns:=", LaunchConfiguration("namespace")],
                    "-r",
                    ["pose:=", LaunchConfiguration("pose")],
                    "-r",
                    ["odom:=", LaunchConfiguration("odom")],
                ],
                output="screen",
                # A node that has ended starts again, closed.
                respawn=True,
                respawn_delay=2.0,
            ),
        ]
    )
