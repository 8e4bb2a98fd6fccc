"""A node answers whatever parameter it is asked to set."""

from __future__ import annotations

import pytest

pytest.importorskip('rclpy')

from hypothesis import given, settings
from hypothesis import strategies as st
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node

from pack_msgs_py.ros.parameter_service import CheckedParameterService
from pack_msgs_py.ros.testing import private_context

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def service(domain):
    with private_context(domain) as context:
        node = Node('asked', context=context, start_parameter_services=False)
        node.declare_parameter('speed', 1.0)
        yield CheckedParameterService(node)
        node.destroy_node()


PARAMETERS = st.lists(
    st.builds(
        Parameter,
        name=st.sampled_from(['speed', 'spede', '', 'use_sim_time', '\x00', 'x' * 1000]),
        value=st.builds(
            ParameterValue, type=st.integers(0, 255), double_value=st.sampled_from([2.0, 1e300])
        ),
    ),
    max_size=3,
)


@settings(deadline=None)
@given(parameters=PARAMETERS)
def test_every_parameter_is_set_or_refused_with_a_reason(service, parameters):
    request = SetParameters.Request(parameters=parameters)
    response = service._set_parameters_callback(request, SetParameters.Response())
    assert len(response.results) == len(parameters)
    assert all(result.successful or result.reason for result in response.results)
    at_once = SetParametersAtomically.Request(parameters=parameters)
    response = service._set_parameters_atomically_callback(
        at_once, SetParametersAtomically.Response()
    )
    assert response.result.successful or response.result.reason


def test_a_type_that_there_is_not_is_named(service):
    unknown = Parameter(name='speed', value=ParameterValue(type=255))
    request = SetParameters.Request(parameters=[unknown])
    (result,) = service._set_parameters_callback(request, SetParameters.Response()).results
    assert "'speed' has type 255; it must be 0 to 9" in result.reason
