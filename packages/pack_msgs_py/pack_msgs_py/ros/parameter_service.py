"""Parameter services that answer whatever they are asked.

Those of rclpy in Jazzy raise on a parameter whose type is none of the ten that there are, which
ends the process of any node: one `set_parameters` request is enough.
"""

from __future__ import annotations

from typing import Any

import rclpy.node
from rcl_interfaces.msg import ParameterType, SetParametersResult
from rclpy.exceptions import ParameterException
from rclpy.parameter_service import ParameterService

from pack_msgs_py.values import shortened

_TYPES = range(ParameterType.PARAMETER_NOT_SET, ParameterType.PARAMETER_STRING_ARRAY + 1)


class CheckedParameterService(ParameterService):
    """Refuses what cannot be a parameter, with the value in the reason."""

    def _set_parameters_callback(self, request: Any, response: Any) -> Any:  # noqa: ANN401 - rclpy's
        kind = type(request)
        for parameter in request.parameters:
            one = type(response)()
            try:
                _check_types([parameter])
                one = super()._set_parameters_callback(kind(parameters=[parameter]), one)
            except (ValueError, ParameterException) as error:
                one.results = [SetParametersResult(successful=False, reason=str(error))]
            response.results = [*response.results, *one.results]
        return response

    def _set_parameters_atomically_callback(self, request: Any, response: Any) -> Any:  # noqa: ANN401 - rclpy's
        try:
            _check_types(request.parameters)
            return super()._set_parameters_atomically_callback(request, response)
        except (ValueError, ParameterException) as error:
            response.result = SetParametersResult(successful=False, reason=str(error))
            return response


def check_parameters_of_nodes() -> None:
    """Give every node that is made from now on in this process the checked services.

    A node makes its own in its constructor, and rclpy has no other place to give it different ones.
    """
    rclpy.node.ParameterService = CheckedParameterService


def _check_types(parameters: Any) -> None:  # noqa: ANN401 - a list of rclpy's messages
    for parameter in parameters:
        if parameter.value.type not in _TYPES:
            msg = (
                f'parameter {shortened(parameter.name)} has type {parameter.value.type}; '
                f'it must be {_TYPES[0]} to {_TYPES[-1]}, see rcl_interfaces/ParameterType'
            )
            raise ValueError(msg)
