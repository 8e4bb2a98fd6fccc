"""A node with the life cycle of ROS 2 that begins by itself, unless it is told not to.

`unconfigured` -- configure --> `inactive` -- activate --> `active`, and back by deactivate and
cleanup; shutdown from each of them. Served as by any managed node: `~/change_state`,
`~/get_state`, `~/get_available_states`, `~/get_available_transitions` and `~/get_transition_graph`
(lifecycle_msgs), with `~/transition_event` for whoever watches.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from pack_msgs_py.parameter_fields import parameter, parameter_fields
from pack_msgs_py.ros.declare_parameters import declare_field

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
ERROR = TransitionCallbackReturn.ERROR
#: How often a node looks that waits for the time, seconds.
CLOCK_PERIOD_S = 0.05
#: What a node that is not active says of itself.
NOT_ACTIVE = 'the node is not active'


@dataclass(frozen=True)
class LifeParameters:
    """Parameters of every node with a life cycle."""

    autostart: bool = parameter(
        True,
        'Begin at once; otherwise the node waits, unconfigured, for its transitions (`ros2 '
        'lifecycle set`, or a manager of life cycles).',
        read_only=True,
    )


class ManagedNode(LifecycleNode):
    """Base of the nodes of the cell that act.

    A subclass declares its parameters in ``__init__`` and calls :meth:`begin` at the end of it; the
    parameters of :class:`LifeParameters` are declared here.

    - :meth:`make` is what *configure* does: read files, make publishers and the like. What it opens
      beside those is closed by what it tells :meth:`at_release`; those are destroyed here.
      ``is_active`` tells it already whether activation follows at once.
    - :meth:`set_active` is what *activate* and *deactivate* do; they come at any time, also in the
      middle of something, which then is brought to its end

    Timers go by the steady clock where no other is named: a node that takes the time from `/clock`
    beats on while that stands still.
    """

    def __init__(self, name: str, **node_arguments: Any) -> None:  # noqa: ANN401 - rclpy's own
        self._steady_clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._ends: list[Callable[[], bool | None]] = []
        self._kept: set[int] = set()
        self._failure: Exception | None = None
        self.is_configured = self.is_active = self._raises = False
        super().__init__(name, **node_arguments)
        try:
            (autostart,) = parameter_fields(LifeParameters)
            self._begins_itself = bool(declare_field(self, autostart))
        except ValueError:
            self.destroy_node()
            raise
        service = self._service_change_state
        service.callback = _that_may_fail(service.callback)

    # -- what a subclass is asked for -----------------------------------------------------------

    def make(self) -> None:
        """Make all that the node works with; an error leaves it unconfigured."""
        raise NotImplementedError

    def set_active(self, *, active: bool) -> None:
        """Begin to act, or begin nothing new."""
        raise NotImplementedError

    def busy(self) -> str:
        """Why the node cannot be cleaned up now, in words; empty when it can."""
        return ''

    def at_release(self, end: Callable[[], bool | None]) -> None:
        """Call ``end`` when what :meth:`make` has made is given back, the last one first.

        It returns False when a thread goes on that cannot be ended.
        """
        self._ends.append(end)

    def release(self) -> bool:
        """Call what :meth:`at_release` was told; may come again.

        False when a thread goes on: then what that may still use stays open.
        """
        while self._ends:
            if self._ends.pop()() is False:
                self._ends.clear()
                return False
        return True

    # -- life -----------------------------------------------------------------------------------

    def begin(self) -> None:
        """Configure and activate, unless that is left to somebody else.

        A node that takes the time from `/clock` is activated once somebody tells it.

        Raises
        ------
        Exception
            What :meth:`make` has raised; the node is destroyed then.
        """
        if not self._begins_itself:
            self.get_logger().info('waits, unconfigured, for its transitions')
            return
        self.is_active, self._raises = self._knows_the_time(), True
        configured = self.trigger_configure()
        self._raises = False
        if configured is not SUCCESS and self._failure is not None:
            failure, self._failure = self._failure, None
            self.destroy_node()
            raise failure
        if self.is_active:
            self.trigger_activate()
            return

        def look() -> None:
            if self._knows_the_time():
                self.destroy_timer(timer)
                if not self.is_active:  # nor has somebody else
                    self.trigger_activate()

        timer = self.create_timer(CLOCK_PERIOD_S, look)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make everything; FAILURE, with the reason in the log, when that cannot be."""
        self._kept = {id(entity) for entity in self._entities()}
        try:
            self.make()
        except Exception as error:  # whatever it is, it must be seen, and the node live on
            self._failure = error
            self.release()
            self._destroy_made()
            if not self._raises:
                self.get_logger().error(f'not configured: {error}')
            return FAILURE
        self.is_configured = True
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to act."""
        self.is_active = True
        self.set_active(active=True)
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin nothing new."""
        self.is_active = False
        self.set_active(active=False)
        self.get_logger().info('not active: nothing new is begun')
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Give everything back; FAILURE while something goes on that must come to its end."""
        busy = self.busy()
        if busy:
            self.get_logger().warning(f'not cleaned up: {busy}')
            return FAILURE
        super().on_cleanup(state)
        return SUCCESS if self._give_back() else ERROR

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop at once, and give everything back; the process ends by its signal, as ever."""
        self.is_active = False
        super().on_shutdown(state)
        if self.is_configured and not self._give_back():
            self.get_logger().error('a thread does not end: end the process')
        return SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """A thread goes on: the node cannot be configured again, only ended."""
        self.get_logger().error('a thread does not end: end the process')
        return FAILURE

    def destroy_node(self) -> None:
        """Give everything back, actions too: rclpy would leave those on the network."""
        self.release()
        if self._kept:
            self._destroy_made()
        super().destroy_node()

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], Any],
        callback_group: Any = None,  # noqa: ANN401 - rclpy's
        clock: Clock | None = None,
        **options: Any,  # noqa: ANN401 - rclpy's
    ) -> Any:  # noqa: ANN401 - rclpy's
        """As rclpy does, but on the steady clock by default."""
        return super().create_timer(
            timer_period_sec, callback, callback_group, clock or self._steady_clock, **options
        )

    def _knows_the_time(self) -> bool:
        return bool(self.get_clock().now().nanoseconds)

    def _give_back(self) -> bool:
        self.is_configured = False
        ended = self.release()
        self._destroy_made()
        return ended

    def _entities(self) -> list[Any]:
        # Waitables last: the events of a subscription go with it.
        some = (self.publishers, self.subscriptions, self.clients, self.services)
        more = (self.timers, self.guards, self.waitables)
        return [entity for entities in (*some, *more) for entity in entities]

    def _destroy_made(self) -> None:
        """Destroy what ROS has made since the node was configured."""
        made = [entity for entity in self._entities() if id(entity) not in self._kept]
        ways = (
            self.destroy_publisher,
            self.destroy_subscription,
            self.destroy_client,
            self.destroy_service,
            self.destroy_timer,
            self.destroy_guard_condition,
        )
        for entity in made:
            if not any(destroy(entity) for destroy in ways) and entity in self.waitables:
                entity.destroy()  # an action's server or client


def _that_may_fail(change: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """``change``, which answers "no" to a transition that there is not from the present state.

    rclpy raises an error there, which would end the process.
    """

    def answer(request: Any, response: Any) -> Any:  # noqa: ANN401 - lifecycle_msgs/ChangeState
        try:
            return change(request, response)
        except RuntimeError:
            response.success = False
            return response

    return answer
