"""What one tab shows, put together: panels left and right, the scene between them, the player below it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from ovita.dialogue.session import Session
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory
from ovita.studio import html, playback, scene_view, turns
from ovita.studio.conversation import Conversation
from ovita.studio.editor import DragEditor, HandEdit, deleted, inserted, sketched
from ovita.studio.files import FilesPanel, Opened
from ovita.studio.guide import HOTKEYS
from ovita.studio.html import BRAND
from ovita.studio.look import LookPanel
from ovita.studio.panels import ChangesPanel, CodePanel, KnobsPanel, LimitsPanel
from ovita.studio.recording import PenRecorder
from ovita.studio.robots import RobotPanel
from ovita.studio.ruler import Ruler
from ovita.studio.scene_view import SceneView
from ovita.studio.sessions import Desk, News, SessionController
from ovita.studio.timeline import Timeline, Wire
from ovita.studio.turns import VIEWS
from ovita.studio.writing import WritersPanel, writer_name

_LEFT, _RIGHT = 350.0, 392.0
_LEFT_NARROW, _RIGHT_NARROW = 310.0, 310.0
_NARROW = 400.0  # of the scene between the panels [pixels]; less is too little


class Tab(Desk):
    """One tab, viser's handle of it, and what it shows.

    `opened`, `again` and `returned` make the controller for an opened session, for the file that the studio was started
    with, and for an earlier session; the browser remembers it. The rest is as in `FilesPanel`, `WritersPanel` and, for
    what can be looked at, `LookPanel`.
    """

    def __init__(
        self,
        client: Any,
        controller: SessionController,
        *,
        offered: dict[str, str],
        opened: Callable[[Opened], SessionController],
        again: Callable[[], SessionController],
        earlier: Callable[[], dict[str, str]],
        returned: Callable[[str], SessionController],
        limits: Robot,
        local: bool,
        lookable: dict[str, str] | None = None,
        wire: Wire,
    ) -> None:
        super().__init__(client, controller)
        self._opened, self._again, self._returned = opened, again, returned
        self._limits = limits
        self._lock = threading.RLock()
        self._closed = False
        self._narrow = False
        self.space = SceneView(client, _LEFT + _RIGHT)
        self.heads = playback.Playheads(self.space)
        self.puppet = playback.RobotView(client.scene, self.complain)
        hands = dict.fromkeys(("pick", "insert", "delete", "sketch"), self._pointed)
        self.timeline = Timeline(wire, self, self._show_moment, self.space.draw_selected, hands)
        self.player = self.timeline.player
        with client.atomic():
            self._build(client.gui, offered, earlier, local, lookable or {})
        self._leave = controller.watch(self.refresh)
        self.refresh("turn")
        self.space.look(controller.session)
        client.camera.on_update(lambda _: self._camera_moved())

    def _build(
        self,
        gui: Any,
        offered: dict[str, str],
        earlier: Callable[[], dict[str, str]],
        local: bool,
        lookable: dict[str, str],
    ) -> None:
        self._theme(gui)
        gui.set_panel_label("ovita studio")
        gui.main_panel.dock_left()
        gui.main_panel.set_width(_LEFT)
        gui.add_html(f'<i data-timeline="{self.timeline.wire.name}"></i>')
        # our own HTML asks for things through this field, which no one sees
        gui.add_html('<i class="bridge"></i>')
        self.bridge = gui.add_text("page", "")
        self.bridge.on_update(lambda _: self.do(str(self.bridge.value).partition(" ")[2]))
        self.header = gui.add_html("")
        tabs = gui.add_tab_group()
        with tabs.add_tab("Say", "message"):
            self.conversation = Conversation(self)
        with tabs.add_tab("Edit", "hand-move"):
            self.hand = DragEditor(self, self.space, self._peek, self.timeline.show_picked)
            self.pen = PenRecorder(self, self.space)
        with tabs.add_tab("Look", "camera"):
            self.looking = LookPanel(self, lookable)
        with tabs.add_tab("View", "eye"):
            self._build_view(gui)
        with tabs.add_tab("Files", "folder"):
            self.filing = FilesPanel(
                self, opened=self.open, again=lambda: self._change_desk(self._again), offered=offered, earlier=earlier,
                returned=lambda name: self._change_desk(lambda: self._returned(name)), limits=self._limits,
            )  # fmt: skip
        with tabs.add_tab("Set up", "settings"):
            WritersPanel(self, self._writer_chosen, local=local)
        top = gui.add_panel()
        with top.add_tab("Parameters", "adjustments"):
            self.knobs = KnobsPanel(self)
        with top.add_tab("Plan", "list-numbers"):
            self.plan = gui.add_html("")
        with top.add_tab("Explanation", "bulb"):
            self.explanation = gui.add_html("")
        top.dock_right()
        top.set_width(_RIGHT)
        self._right = top
        below = gui.add_panel()
        with below.add_tab("Changes", "chart-line"):
            self.changes = ChangesPanel(self)
        with below.add_tab("Constraints", "shield-check"):
            self.limits = LimitsPanel(self)
        with below.add_tab("Robot", "robot"):
            self.robots = RobotPanel(self, self.puppet, self.limits.offer, local=local)
        with below.add_tab("Code", "code"):
            self.code = CodePanel(self)
        below.dock_below(top)
        for key in HOTKEYS:
            command = gui.add_command(key.does.strip().capitalize(), hotkey=key.hotkey, modifier=key.held)
            command.on_trigger(lambda _, wish=key.wish: self.do(wish))

    def do(self, wish: str) -> None:
        """Do what a key or our own HTML asks for, such as "undo", "look top" or "go 3"; anything else is ignored."""
        verb, _, what = wish.partition(" ")
        if verb in ("undo", "redo"):
            self.conversation.step(verb.capitalize())
        elif verb == "play":
            self.player.toggle()
        elif verb == "go" and what.isdecimal():
            self.conversation.go(int(what) - 1)
        elif verb == "look" and what in VIEWS:
            self._look(what)
        elif verb == "dark":
            self._darken(what == "1")

    def _look(self, view: str) -> None:
        self.space.follow(not self.space.following if view == "follow" else False)
        if self.space.following:
            self.tell("The view goes along with what moves; \u201cfollow\u201d again, or another view, stops it.")
            self._show_moment(self.player.moment)
        elif view != "follow":
            self.space.look(self.controller.session, view)

    def _darken(self, dark: bool) -> None:
        self.space.dark = dark
        self._theme(self.client.gui)
        with self._lock, self.controller.lock:
            self.space.redraw(self.controller.session)
            self.heads.place([])
            self._show_moment(self.player.moment)

    def _theme(self, gui: Any) -> None:
        gui.configure_theme(
            control_width="medium", show_logo=False, show_share_button=False, brand_color=BRAND,
            dark_mode=self.space.dark,
        )  # fmt: skip

    def _camera_moved(self) -> None:
        self.space.covered = 0.0
        free = float(self.client.camera.image_width) - self._narrow * (_LEFT + _RIGHT - _LEFT_NARROW - _RIGHT_NARROW)
        if self._narrow != (free < _NARROW):
            self._narrow = not self._narrow
            self._right.set_width(_RIGHT_NARROW if self._narrow else _RIGHT)
            self.client.gui.main_panel.set_width(_LEFT_NARROW if self._narrow else _LEFT)
        self.space.look_again(self.controller.session)
        self.timeline.see(self.client.camera)

    def _build_view(self, gui: Any) -> None:
        shown = self.space.shown
        gui.add_html(html.block("<h4>Show</h4>"))
        boxes = {
            "speeds": gui.add_checkbox("speed", shown.speeds, hint="Colour the red line by its speed"),
            "waypoints": gui.add_checkbox("waypoints", shown.waypoints),
            "ghost": gui.add_checkbox("last version", shown.ghost, hint="The line as it was one turn ago, pale"),
            "margins": gui.add_checkbox("margins", shown.margins, hint="How far the path must stay from each object"),
            "workspace": gui.add_checkbox("workspace", shown.workspace),
            "labels": gui.add_checkbox("names", shown.labels),
        }
        self.ramp = gui.add_html("", visible=False)

        def switched(_: Any) -> None:
            for name, box in boxes.items():
                setattr(self.space.shown, name, box.value)
            with self._lock, self.controller.lock:
                self.space.update_shown(self.controller.session)
            self._show_ramp()

        for box in boxes.values():
            box.on_update(switched)
        self.ruler = Ruler(self, self.space)
        gui.add_html(html.block(
            "<h4>Voice</h4><p><label><input type='checkbox' data-keep='voice'> a button to speak what should change"
            "</label></p><p class='soft'>The browser's own service writes it down, where it has one; what you say may"
            " leave this machine for it.</p>"
            "<h4>Colours</h4><p><span class='key' style='background:var(--blue)'></span>original<br>"
            "<span class='key' style='background:var(--red)'></span>adapted<br>"
            "<span class='key' style='background:#ffb300'></span>what was understood, until you accept it<br>"
            "<span class='key' style='background:#eeb1ab'></span>one turn ago<br>"
            "<span class='key' style='background:#8a8a8a'></span>as the program proposed it<br>"
            "<span class='key' style='background:#7a3cff'></span>where the proposal broke a limit</p>"
            "<p class='soft'>Left mouse button turns the view, right one shifts it, wheel zooms.</p>"
        ))  # fmt: skip

    def refresh(self, news: News) -> None:
        """Show what changed; called on the thread that changed it."""
        with self._lock:
            if self._closed:
                return
            with self.controller.lock:
                if news == "line":
                    self._redraw(news)
                    return
                with self.client.atomic():
                    self._refresh(news)

    def _redraw(self, news: News) -> None:
        with self.client.atomic():
            self.space.draw(self.controller.session)
        self.timeline.refresh(lines=news == "turn")

    def _refresh(self, news: News) -> None:
        session = self.controller.session
        self.conversation.refresh(news)
        if news == "error" and self.controller.error:
            self.complain(self.controller.error)
        if news == "said":
            self.space.draw_lines(session)
        if news not in ("turn", "knobs"):
            return
        self.header.content = turns.header(self.controller, writer_name(session.writer))
        if news == "turn":
            self._redraw(news)
        self.knobs.refresh(turned=news == "knobs")
        self.plan.content = html.plan(session.adaptation)
        self.explanation.content = html.explanation(session.adaptation)
        for part in (self.changes, self.code, self.limits):
            part.refresh()
        if news == "turn":
            self.hand.refresh()
            self.space.look_again(session)
        self.robots.refresh()
        self.ruler.refresh()
        self._show_ramp()

    def open(self, opened: Opened) -> None:
        """Show a session that was opened."""
        self._change_desk(lambda: self._opened(opened))
        if self.controller.session is opened.session:
            self.space.draw_tube(opened.session.original.positions, opened.covariance)
        for note in opened.notes:
            self.tell(note)

    def close(self) -> None:
        """Stop everything that runs for this tab."""
        self._leave()
        with self._lock:
            self._closed = True
        self.player.close()
        self.conversation.close()
        self.puppet.name = playback.NOBODY

    def _peek(self, session: Session) -> None:
        with self._lock:
            if not self._closed and (self.hand.dragging or session is self.controller.session):
                with self.client.atomic():
                    self.space.draw_lines(session)

    def _pointed(self, said: Mapping[str, Any]) -> None:
        """Do what the timeline asks for on a thread of its own, since its line must not wait."""
        edit: Callable[[], HandEdit]
        match said["kind"]:
            case "pick":
                index = None if said["index"] is None else int(said["index"])
                threading.Thread(target=self.hand.pick, args=(index,), name="ovita-hands", daemon=True).start()
                return
            case "insert":
                edit = partial(inserted, int(said["after"]))
            case "delete":
                first, last = sorted(map(int, said["range"]))
                edit = partial(deleted, first, last)
            case _:
                line, (first, last) = np.array(said["line"], dtype=float), sorted(map(int, said["range"]))
                edit = partial(sketched, line, first, last)
        work = partial(self.controller.act, lambda session: edit().do(session))
        threading.Thread(target=work, name="ovita-hands", daemon=True).start()

    def _change_desk(self, make: Callable[[], SessionController]) -> None:
        if self.controller.busy is not None:
            self.complain("An instruction is being worked on; wait for it or cancel it.")
            return
        with self.complaining():
            controller = make()
            with self._lock:
                self._leave()
                self.controller = controller
                self.hand.let_go()
                self.pen.let_go()
                self.heads.place([])
                self.puppet.choose(str(self.robots.which.value))
                self.space.reset()
                self._leave = controller.watch(self.refresh)
                self.refresh("turn")
                self.space.look(controller.session)
            self.filing.refresh()

    def _writer_chosen(self) -> None:
        self.refresh("turn")
        self.tell(f"From now on {writer_name(self.controller.session.writer)} writes the programs.")

    def _show_moment(self, at: float) -> None:
        session = self.controller.session
        paths: list[Trajectory] = [session.original, *([session.current] if session.steps else [])]
        places = [path.at(at).positions[0] for path in paths] if at > 0.0 else []
        self.heads.place(places)
        if places:
            self.space.keep_in_view(places[-1])
        self.puppet.show(at)

    def _show_ramp(self) -> None:
        session = self.controller.session
        self.ramp.visible = self.space.shown.speeds
        low, high = self.space.pace(session)
        self.ramp.content = html.block(
            f'<div class="ramp" style="background:{scene_view.RAMP_CSS}"></div>'
            f'<div class="soft">{low:.2f} m/s to {high:.2f} m/s</div>'
        )
