"""A node for which security is asked starts with it or not at all."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

NODE = (
    'from rclpy.node import Node; from pack_msgs_py.ros.run_node import run_node; '
    "run_node('asked', lambda: Node('asked'))"
)


@pytest.mark.parametrize('enclave', ['', 'enclaves/asked'])
def test_without_keys_or_a_middleware_that_knows_security_nothing_starts(
    tmp_path, ros_domain, enclave
):
    (tmp_path / enclave).mkdir(parents=True, exist_ok=True)
    env = dict(
        os.environ,
        ROS_SECURITY_ENABLE='true',
        ROS_SECURITY_STRATEGY='Enforce',
        ROS_SECURITY_KEYSTORE=str(tmp_path),
    )
    arguments = ['--ros-args', '--enclave', '/asked'] if enclave else []
    done = subprocess.run(
        [sys.executable, '-c', NODE, *arguments],
        env=env,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    said = done.stdout + done.stderr
    assert done.returncode == 2, said
    assert 'security is asked for' in said and 'Traceback' not in said


def test_other_errors_stay_what_they_are(monkeypatch):
    from pack_msgs_py.ros.security import NoSecurity, secured_or_nothing

    monkeypatch.setenv('ROS_SECURITY_ENABLE', 'true')
    with pytest.raises(RuntimeError, match='no such topic'), secured_or_nothing():
        raise RuntimeError('no such topic')
    monkeypatch.setenv('ROS_SECURITY_ENABLE', 'false')
    with pytest.raises(RuntimeError), secured_or_nothing():
        raise RuntimeError('SECURITY ERROR')
    monkeypatch.setenv('ROS_SECURITY_ENABLE', 'true')
    with pytest.raises(NoSecurity, match='SECURITY ERROR'), secured_or_nothing():
        raise RuntimeError('SECURITY ERROR')
