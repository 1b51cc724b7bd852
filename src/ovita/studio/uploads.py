"""A lid on uploads: viser takes whatever a browser sends; here a transfer ends where it grows too large."""

from __future__ import annotations

from typing import Any

from ovita.studio.files import MAX_UPLOAD, too_large


def limit_uploads(client: Any) -> None:
    """Refuse files above `MAX_UPLOAD` from a tab before their content is taken.

    Args:
        client: viser's handle of the tab.
    """
    from viser import _messages as messages

    gui, connection = client.gui, client._websock_connection
    start, part = gui._handle_file_transfer_start, gui._handle_file_transfer_part
    running = gui._current_file_upload_states

    def refuse(size: int, message: Any) -> None:
        running.pop(message.transfer_uuid, None)
        # the client shows its progress until it hears that all of it came
        connection.queue_message(
            messages.FileTransferPartAck(
                source_component_uuid=message.source_component_uuid,
                transfer_uuid=message.transfer_uuid,
                transferred_bytes=size,
                total_bytes=size,
            )
        )
        client.add_notification(
            "That did not work", f"The file {too_large(size)}.", auto_close_seconds=9.0, color="red"
        )

    def started(client_id: Any, message: Any) -> None:
        if message.size_bytes > MAX_UPLOAD or message.part_count > MAX_UPLOAD // 1024 or len(running) >= 4:
            refuse(max(int(message.size_bytes), 1), message)
        else:
            start(client_id, message)

    def arrived(client_id: Any, message: Any) -> None:
        state = running.get(message.transfer_uuid)
        if state is not None and state["transferred_bytes"] + len(message.content) > state["total_bytes"]:
            running.pop(message.transfer_uuid, None)
            return
        part(client_id, message)

    for kind, old, new in (
        (messages.FileTransferStartUpload, start, started),
        (messages.FileTransferPart, part, arrived),
    ):
        connection.unregister_handler(kind, old)
        connection.register_handler(kind, new)
