"""The page itself: a viser scene with panels beside it, fed from a :class:`CellView`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
import viser

from arm_executor.model.layout import Layout
from arm_executor.model.robot_shapes import RobotShapes
from pack_cell.view.box_drawing import DrawnBatch
from pack_cell.view.cell_view import CellView
from pack_cell.view.robot_drawing import DrawnRobot, wxyz
from pack_cell.view.scene import bin_middle, drawn_cell
from pack_cell.view.side import alarms_html, figures_html, lately_html, state_of, why_html
from pack_cell.view.web_server import start_server, stop_server
from pack_msgs_py.geometry.pose import metres
from pack_msgs_py.values import STATIONS, Vec3

#: The red of the banner: white can be read on it.
_STOP = (193, 23, 23)
#: Width of the panel, pixels.
_PANEL = 400
#: Where one sees the whole cell from, and what one looks at.
_FROM, _AT = (-3.4, -3.0, 3.6), (0.0, 0.7, 0.6)
#: The same on an upright screen, of which the panel covers the lower half.
_UPRIGHT_FROM, _UPRIGHT_AT = (-1.5, -6.5, 7.0), (-0.15, -0.2, -1.1)


class Order(str, Enum):
    """What a button asks the cell for."""

    PAUSE = 'pause'
    RESUME = 'resume'
    STOP = 'stop'
    RESET = 'reset'
    SWAP_BIN = 'swap_bin'
    CLOSE_BIN = 'close_bin'
    HOLD_BIN = 'hold_bin'
    RELEASE_BIN = 'release_bin'
    DRAIN = 'drain'
    FEED = 'feed'
    EMPTY = 'empty'
    FINISH = 'finish'
    ACKNOWLEDGE = 'acknowledge'


@dataclass(frozen=True)
class PageAddress:
    """Where the page is served; port 0 takes any free one."""

    host: str
    port: int


def _fit_phone(client: viser.ClientHandle) -> None:
    """Show the whole cell above the panel."""
    if _is_upright(client):
        with client.atomic():
            client.camera.position, client.camera.look_at = _UPRIGHT_FROM, _UPRIGHT_AT


def _is_upright(client: viser.ClientHandle) -> bool:
    return client.camera.image_width < client.camera.image_height


class CellPage:
    """Serves the page of ``view``.

    All methods are for one thread; called from others are ``order``, by buttons, with a bin where
    it is about one, and ``on_look``, when somebody opens the page.

    Raises
    ------
    PageTaken
        The address cannot be had.
    """

    def __init__(
        self,
        view: CellView,
        address: PageAddress,
        order: Callable[[Order, str], None],
        on_look: Callable[[], None] = lambda: None,
    ) -> None:
        self._view, self._order = view, order
        self._layout = Layout()
        self._state = state_of(view)
        self._server = start_server(address.host, address.port, lambda: self._state)
        self._robot: DrawnRobot | None = None
        self._robot_shapes: RobotShapes | None = None
        self._drawn, self._written = -1, -1
        self._html: dict[str, str] = {}
        self._held = ''
        self._labels: dict[str, viser.LabelHandle] = {}
        self._names: tuple[str, ...] = ()
        self._make_panel()
        self._make_scene()
        self._server.on_client_connect(_fit_phone)
        self._server.on_client_connect(lambda client: on_look())

    @property
    def port(self) -> int:
        """Where it is really served."""
        return int(self._server.get_port())

    @property
    def watched(self) -> bool:
        """Whether anybody looks."""
        return bool(self._server.get_clients())

    def stand_like(self, layout: Layout) -> None:
        """The cell stands as ``layout`` says."""
        if layout != self._layout:
            self._layout = layout
            self._drawn = -1

    def tell(self, text: str, *, good: bool) -> None:
        """Show those who look what came of an order."""
        for client in self._server.get_clients().values():
            client.add_notification(
                'Done' if good else 'Not done',
                text,
                color='green' if good else 'red',
                auto_close_seconds=6.0,
            )

    def close(self) -> None:
        """Stop serving."""
        stop_server(self._server)

    # -- regularly -------------------------------------------------------------------------------

    def refresh_state(self) -> None:
        """What the banner shows; cheap, whether anybody looks or not."""
        self._state = state_of(self._view)

    def refresh_text(self) -> None:
        """What stands beside the scene, as far as it has changed."""
        self._write('alarms', alarms_html(self._view))
        self._write('lately', lately_html(self._view))
        paused, stopped = self._view.is_paused, self._view.is_stopped
        for button, is_shown in (
            (self._pause, not paused and not stopped),
            (self._resume, paused and not stopped),
            (self._stop, not stopped),
            (self._reset, stopped),
            (self._acknowledge, bool(self._view.alarms)),
        ):
            if button.visible != is_shown:
                button.visible = is_shown
        if self._written == self._view.text_changes:
            return
        self._written = self._view.text_changes
        self._write('figures', figures_html(self._view))
        self._write('why', why_html(self._view))
        names = tuple(found.id for found in self._view.bins)
        if names != self._names and names:
            self._names = names
            self._bin.options = names

    def _write(self, name: str, html: str) -> None:
        if self._html.get(name) != html:
            self._html[name] = html
            self._pieces[name].content = html

    def refresh_scene(self) -> None:
        """What has moved."""
        view = self._view
        if view.robot is not None and view.robot is not self._robot_shapes:
            self._robot_shapes = view.robot
            self._robot = DrawnRobot(self._server, view.robot)
        if self._robot is not None:
            self._robot.move(view.joints)
        if self._drawn == view.scene_changes:
            return
        self._drawn = view.scene_changes
        drawn = drawn_cell(view, self._layout)
        with self._server.atomic():
            self._solid.show(drawn.solid)
            self._walls.show(drawn.walls)
            self._placed.show(drawn.placed)
            self._waiting.show(drawn.waiting)
            self._ghosts.show(drawn.ghosts)
            self._draw_held()
            self._write_labels({label.key: (label.text, label.position) for label in drawn.labels})

    # -- the scene -------------------------------------------------------------------------------

    def _make_scene(self) -> None:
        server = self._server
        server.scene.set_up_direction('+z')
        server.scene.world_axes.visible = False
        server.scene.add_grid('/floor', width=8.0, height=8.0, cell_size=0.5, section_size=1.0)
        server.initial_camera.position = _FROM
        server.initial_camera.look_at = _AT
        server.initial_camera.fov = 0.75
        self._solid = DrawnBatch(server, 'solid', with_edges=False)
        self._walls = DrawnBatch(server, 'walls', opacity=0.18)
        self._placed = DrawnBatch(server, 'placed')
        self._waiting = DrawnBatch(server, 'waiting')
        self._ghosts = DrawnBatch(server, 'ghosts', opacity=0.55)

    def _draw_held(self) -> None:
        held, robot = self._view.held, self._robot
        key = '' if held is None else held.box.id
        if robot is None or self._held == key:
            return
        self._held = key
        name = f'{robot.node("tcp")}/held'
        if held is None:
            self._server.scene.remove_by_name(name)
            return
        self._server.scene.add_box(
            name,
            dimensions=metres(held.box.size_mm),
            color=(250, 158, 26),
            position=held.pose.position,
            wxyz=wxyz(held.pose),
        )

    def _write_labels(self, labels: dict[str, tuple[str, Vec3]]) -> None:
        for key in set(self._labels) - set(labels):
            self._labels.pop(key).remove()
        for key, (text, position) in labels.items():
            known = self._labels.get(key)
            if known is None:
                self._labels[key] = self._server.scene.add_label(
                    f'/labels/{key}',
                    text,
                    position=position,
                    anchor='bottom-center',
                    font_screen_scale=1.35,
                )
                continue
            if known.text != text:
                known.text = text
            if tuple(known.position) != position:
                known.position = np.array(position)

    # -- the panel -------------------------------------------------------------------------------

    def _make_panel(self) -> None:
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(21, 87, 192))
        gui.set_panel_label('Packing cell')
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_PANEL)
        self._pieces: dict[str, viser.GuiHtmlHandle] = {}
        self._make_buttons()
        self._pieces['alarms'] = gui.add_html('')
        for name, label in (('figures', 'Figures'), ('why', 'Why this box')):
            with gui.add_folder(label):
                self._pieces[name] = gui.add_html('')
        with gui.add_folder('One bin'):
            self._bin = gui.add_dropdown('Bin', ('–',))
            for label, order in (
                ('Swap: close it, an empty one comes', Order.SWAP_BIN),
                ('Close it, and leave its place empty', Order.CLOSE_BIN),
                ('Hold: no more boxes into it', Order.HOLD_BIN),
                ('Release: boxes go into it again', Order.RELEASE_BIN),
            ):
                self._give(gui.add_button(label, color='gray'), order)
        with gui.add_folder('Belt and shift'):
            self._give(gui.add_button('Drain: feed no more boxes', color='gray'), Order.DRAIN)
            self._give(gui.add_button('Feed again', color='gray'), Order.FEED)
            for label, order, question in (
                (
                    'Empty the belt to the reject lane',
                    Order.EMPTY,
                    'Every box on the belt goes to the reject lane, and no more are fed.',
                ),
                (
                    'Finish the shift',
                    Order.FINISH,
                    'The belt goes to the reject lane, and every bin with a box is closed.',
                ),
            ):
                self._ask_first(gui.add_button(label, color='gray'), order, question)
        with gui.add_folder('Lately'):
            self._pieces['lately'] = gui.add_html('')

    def _make_buttons(self) -> None:
        gui = self._server.gui
        self._pause = gui.add_button('Pause', color='yellow', icon=viser.Icon.PLAYER_PAUSE)
        self._resume = gui.add_button('Resume', color='green', icon=viser.Icon.PLAYER_PLAY)
        self._stop = gui.add_button('Stop', color=_STOP, icon=viser.Icon.HAND_STOP)
        self._reset = gui.add_button('Reset', color='blue', icon=viser.Icon.REFRESH)
        self._acknowledge = gui.add_button('Acknowledge', color='orange', icon=viser.Icon.CHECK)
        for button, order in (
            (self._pause, Order.PAUSE),
            (self._resume, Order.RESUME),
            (self._stop, Order.STOP),
            (self._reset, Order.RESET),
            (self._acknowledge, Order.ACKNOWLEDGE),
        ):
            self._give(button, order)
        views = gui.add_button_group('Look at', ('All', *STATIONS))
        views.on_click(lambda event: self._look_at(event.client, views.value))

    def _give(self, button: viser.GuiButtonHandle, order: Order) -> None:
        button.on_click(lambda _: self._order(order, str(self._bin.value)))

    def _ask_first(self, button: viser.GuiButtonHandle, order: Order, what: str) -> None:
        """Have ``button`` ask back, as what it does cannot be undone."""

        def ask(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client is None:
                return
            with event.client.gui.add_modal(button.label) as modal:
                event.client.gui.add_markdown(what)
                yes = event.client.gui.add_button(f'Yes: {button.label.lower()}', color='red')
                no = event.client.gui.add_button('No', color='gray')

            def answer(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
                modal.close()
                if event.target is yes:
                    self._order(order, '')

            yes.on_click(answer)
            no.on_click(answer)

        button.on_click(ask)

    def _look_at(self, client: viser.ClientHandle | None, what: str) -> None:
        """Turn the camera of who has pressed to a station, about which it then orbits."""
        if client is None:
            return
        middle = next(
            (bin_middle(found, self._layout) for found in self._view.bins if found.station == what),
            None,
        )
        with client.atomic():
            upright = _is_upright(client)
            if middle is None:
                seen = (_UPRIGHT_FROM, _UPRIGHT_AT) if upright else (_FROM, _AT)
                client.camera.position, client.camera.look_at = seen
                return
            x, y, z = middle
            far, low = (2.0, 0.9) if upright else (1.0, 0.0)
            side = -1.9 if y > 0 else 1.9
            client.camera.position = (x - 1.1 * far, y + side * far, z + 1.9 * far)
            client.camera.look_at = (x, y, z - low)
