"""A tab of a browser without a browser: it speaks viser's protocol, for tests and measurements of the server."""

from __future__ import annotations

import json
import re
import struct
import threading
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import msgspec.msgpack
import zstandard
from websockets.sync.client import connect


class Tab:
    """One connection to a studio.

    Args:
        url: Of the studio.
        storage: What the browser's local storage holds; shared by the tabs of one browser.
        headers: Further headers, such as a cookie.
    """

    def __init__(self, url: str, storage: dict[str, str] | None = None, headers: dict[str, str] | None = None) -> None:
        import viser

        parts = urlsplit(url)
        self.storage = {} if storage is None else storage
        self.parts: dict[str, dict[str, Any]] = {}
        self.nodes: dict[str, dict[str, Any]] = {}
        self.visible: dict[str, bool] = {}
        self.poses: dict[str, Any] = {}
        self.notices: list[str] = []
        self.downloads: dict[str, bytes] = {}
        self._names: dict[str, str] = {}
        self.seen = 0
        self._changed = threading.Condition()
        self.heard: dict[str, dict[str, Any]] = {}
        self._timeline: Any = None
        self._address = f"ws://{parts.netloc}/"
        self._socket = connect(
            self._address,
            subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
            additional_headers=headers,
            max_size=None,
            compression=None,
            open_timeout=10,
        )
        threading.Thread(target=self._listen, daemon=True).start()
        pose = {"wxyz": (1.0, 0.0, 0.0, 0.0), "position": (3.0, 3.0, 3.0), "fov": 1.0, "near": 0.01, "far": 1000.0}
        ends = {"look_at": (0.0, 0.0, 0.0), "up_direction": (0.0, 0.0, 1.0), "image_height": 800, "image_width": 1280}
        self.send("ViewerCameraMessage", **pose, **ends)

    def send(self, kind: str, **fields: Any) -> None:
        """Send a message of the browser."""
        self._socket.send(msgspec.msgpack.encode({"type": kind, **fields}))

    def point(self, kind: str, **fields: Any) -> None:
        """Send what a person does in the timeline."""
        if self._timeline is None:
            name = re.search(r'data-timeline="(\w+)"', self.text())
            assert name, "there is no timeline"
            self._timeline = connect(f"{self._address}timeline/{name[1]}", open_timeout=10)
            threading.Thread(target=self._hear, daemon=True).start()
        self._timeline.send(json.dumps({"kind": kind, **fields}))

    def close(self) -> None:
        """Leave."""
        if self._timeline is not None:
            self._timeline.close()
        self._socket.close()

    def wait(self, condition: Callable[[], Any], seconds: float = 40.0) -> Any:
        """Wait until a condition on this tab holds, and return its value."""
        ends = time.monotonic() + seconds
        with self._changed:
            while not (value := condition()):
                left = ends - time.monotonic()
                if left <= 0.0:
                    raise AssertionError(f"nothing like it within {seconds} s; the page reads: {self.text()[:600]}")
                self._changed.wait(min(left, 0.2))
        return value

    def ready(self) -> Tab:
        """Wait until the page is built."""
        self.wait(lambda: self.find("Send") and "/lines/original" in self.nodes and "waypoints" in self.text(), 60.0)
        return self

    def find(self, label: str) -> str:
        """The id of the part with that label, or ""."""
        for uuid, part in self.parts.items():
            if part["props"].get("label") == label:
                return uuid
        return ""

    def value(self, label: str) -> Any:
        """The value of the part with that label."""
        return self.parts[self.find(label)].get("value")

    def set(self, label: str, value: Any) -> None:
        """Change the value of a part as a person does."""
        uuid = self.find(label)
        assert uuid, f"there is no {label!r}"
        self.parts[uuid]["value"] = value
        self.send("GuiUpdateMessage", uuid=uuid, updates={"value": value})

    def click(self, label: str) -> None:
        """Click a button."""
        self.set(label, True)

    def say(self, text: str) -> None:
        """Type an instruction and press Enter."""
        form = next(u for u, p in self.parts.items() if p["type"] == "GuiFormMessage")
        field = next(u for u, p in self.parts.items() if p["type"] == "GuiTextMessage" and p["container_uuid"] == form)
        self.send("GuiUpdateMessage", uuid=field, updates={"value": text})
        time.sleep(0.05)
        self.send("GuiFormSubmitMessage", uuid=form)

    def upload(self, name: str, content: bytes, declared: int | None = None, button: str = "Upload a file") -> None:
        """Upload a file."""
        uuid, size = self.find(button), len(content) if declared is None else declared
        common = {"source_component_uuid": uuid, "transfer_uuid": f"{name}-{time.monotonic_ns()}"}
        self.send("FileTransferStartUpload", **common, filename=name, mime_type="", part_count=1, size_bytes=size)
        self.send("FileTransferPart", **common, part_index=0, content=content)

    def text(self) -> str:
        """Everything that stands on the page as HTML."""
        shown = [p["props"] for p in self.parts.values() if p["props"].get("visible", True)]
        return "\n".join(str(p.get("content", "")) for p in shown)

    def points(self, node: str) -> Any:
        """The segments (N, 2, 3) of a line, or None where it is not shown."""
        import numpy as np

        if node not in self.nodes or not self.visible.get(node, True):
            return None
        return np.frombuffer(self.nodes[node]["props"]["points"], dtype=np.float32).reshape(-1, 2, 3)

    def _hear(self) -> None:
        try:
            for raw in self._timeline:  # type: ignore[union-attr]
                message = json.loads(raw)
                with self._changed:
                    self.heard[message["kind"]] = message
                    self._changed.notify_all()
        except Exception as error:  # as below
            del error

    def _listen(self) -> None:
        try:
            for raw in self._socket:
                self._take(raw)  # type: ignore[arg-type]
        except Exception as error:  # the connection is gone; whoever waits sees that nothing comes
            del error

    def _take(self, raw: bytes) -> None:
        size, packed = struct.unpack("<QQ", raw[:16])
        del size
        content = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed]))
        at, buffers = 16 + packed, []
        for length in content["binaryBufferLengths"]:
            at += (8 - at % 8) % 8
            buffers.append(raw[at : at + length])
            at += length
        with self._changed:
            for message in content["messages"]:
                self._apply(_filled(message, buffers))
                self.seen += 1
            self._changed.notify_all()

    def _apply(self, message: dict[str, Any]) -> None:
        kind = message["type"]
        handler = getattr(self, f"_on_{kind}", None)
        if handler is not None:
            handler(message)
        elif kind.startswith("Gui") and "props" in message:
            self.parts[message["uuid"]] = message
        elif "name" in message and "props" in message:
            self.nodes[message["name"]] = message

    def _on_LocalStorageGetItemRequestMessage(self, message: dict[str, Any]) -> None:
        value, uuid = self.storage.get(message["key"]), message["request_uuid"]
        self.send("LocalStorageGetItemResponseMessage", value=value, error=None, request_uuid=uuid)

    def _on_LocalStorageSetItemMessage(self, message: dict[str, Any]) -> None:
        self.storage[message["key"]] = message["value"]

    def _on_GuiUpdateMessage(self, message: dict[str, Any]) -> None:
        part = self.parts.get(message["uuid"], {"props": {}})
        for name, value in message["updates"].items():
            (part if name == "value" else part["props"])[name] = value

    def _on_GuiRemoveMessage(self, message: dict[str, Any]) -> None:
        self.parts.pop(message["uuid"], None)

    def _on_NotificationShowMessage(self, message: dict[str, Any]) -> None:
        self.notices.append(message["props"]["body"])

    def _on_SceneNodeUpdateMessage(self, message: dict[str, Any]) -> None:
        self.nodes.get(message["name"], {"props": {}})["props"].update(message["updates"])

    def _on_SetSceneNodeVisibilityMessage(self, message: dict[str, Any]) -> None:
        self.visible[message["name"]] = message["visible"]

    def _on_SetPositionMessage(self, message: dict[str, Any]) -> None:
        self.poses[message["name"]] = message["position"]

    def _on_RemoveSceneNodeMessage(self, message: dict[str, Any]) -> None:
        self.nodes.pop(message["name"], None)

    def _on_FileTransferStartDownload(self, message: dict[str, Any]) -> None:
        self._names[message["transfer_uuid"]] = message["filename"]

    def _on_FileTransferPart(self, message: dict[str, Any]) -> None:
        name = self._names[message["transfer_uuid"]]
        self.downloads[name] = self.downloads.get(name, b"") + bytes(message["content"])


def _filled(value: Any, buffers: list[bytes]) -> Any:
    """The message with its arrays in place."""
    if isinstance(value, dict):
        if "__binary_index" in value:
            return buffers[value["__binary_index"]]
        return {k: _filled(v, buffers) for k, v in value.items()}
    return [_filled(v, buffers) for v in value] if isinstance(value, list) else value
