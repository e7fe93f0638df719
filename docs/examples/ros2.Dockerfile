# Nav2 and navbench in one image: docker build -f docs/examples/ros2.Dockerfile -t navbench-ros2 .
# Written from Nav2's documentation; it was not built by the tests.
FROM ros:jazzy

RUN apt-get update \
    && apt-get install -y --no-install-recommends \
        build-essential python3-dev python3-pip python3-venv \
        ros-jazzy-navigation2 ros-jazzy-nav2-bringup \
    && rm -rf /var/lib/apt/lists/*

# Python 3.12: PyBullet has no wheel for it and is compiled
COPY . /opt/navbench
RUN python3 -m venv --system-site-packages /opt/venv \
    && /opt/venv/bin/pip install -c /opt/navbench/constraints.txt /opt/navbench cyclonedds==11.0.1

ENV PATH=/opt/venv/bin:$PATH ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
