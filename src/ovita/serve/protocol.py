"""MCP: the tools and resources as the official SDK serves them, over stdio or streamable HTTP (extra `serve`)."""

from __future__ import annotations

import base64
import functools
import json
import logging
import secrets
import threading
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

from ovita.errors import OvitaError, RequestError, needs
from ovita.serve.access import Caller, Transport, Unanswered, one_line
from ovita.serve.application import ADDRESS, RESOURCES, Application, address_of
from ovita.serve.messages import PictureReport, ToolOutcome
from ovita.serve.operations import INSTRUCTIONS, OPERATIONS, Operation, perform
from ovita.text import clean_text

WORKERS = 4
"""How many calls are worked on at a time; more wait."""

QUESTIONS = 16
"""How many people may be asked at a time."""

MOST_QUESTIONS = 1_000
"""How many questions may wait for an answer that comes with the next try."""

ANSWER_WITHIN = 600.0
"""How long a person has to answer [s]."""

SERVE_OWNER = "ovita.owner"
"""Under which key of the ASGI scope the owner of a request's token stands."""

_CONFIRMATION = {
    "type": "object",
    "properties": {"send": {"type": "boolean", "title": "Send it", "description": "Yes, send this path to the robot"}},
    "required": ["send"],
}
_log = logging.getLogger("ovita.serve")


def require() -> None:
    """Make sure that the SDK is installed.

    Raises:
        MissingExtra: If it is not.
    """
    with needs("mcp", "serve"):
        import mcp.server.lowlevel  # noqa: F401


class ToolServer:
    """The MCP server of an application."""

    def __init__(self, application: Application) -> None:
        from mcp.server.lowlevel import Server

        self.application = application
        self._questions = OpenQuestions()
        self.server: Any = Server(
            "ovita",
            version=version("ovita"),
            title="ovita",
            description="Adapts robot trajectories by instruction and checks them",
            instructions=INSTRUCTIONS,
            on_list_tools=self._list_tools,
            on_call_tool=self._call_tool,
            on_list_resources=self._list_resources,
            on_list_resource_templates=self._list_templates,
            on_read_resource=self._read_resource,
        )

    async def stdio(self) -> None:
        """Serve one client over standard input and output until it leaves."""
        from mcp.server.stdio import stdio_server

        async with stdio_server() as (reading, writing):
            await self.server.run(reading, writing, self.server.create_initialization_options())

    @functools.cached_property
    def _limits(self) -> tuple[Any, Any]:
        """How much is worked on, and how many people are asked, at a time; made inside the event loop."""
        import anyio

        return anyio.CapacityLimiter(WORKERS), anyio.CapacityLimiter(QUESTIONS)

    async def work(self, do: Callable[[], Any], *, asks: bool = False) -> Any:
        """Do something on a worker thread."""
        import anyio.to_thread

        return await anyio.to_thread.run_sync(do, limiter=self._limits[asks])

    async def _list_tools(self, ctx: Any, params: Any) -> Any:
        import mcp_types as types

        return types.ListToolsResult(tools=[_tool(operation) for operation in OPERATIONS.values()])

    async def _call_tool(self, ctx: Any, params: Any) -> Any:
        import mcp_types as types

        arguments = params.arguments or {}
        caller = self._caller(ctx, params)
        try:
            size = len(json.dumps(arguments))
            outcome = await self.work(
                lambda: perform(self.application, params.name, arguments, caller, size), asks=params.name == "send"
            )
        except Unanswered as asked:
            form = types.ElicitRequestFormParams(message=asked.question, requested_schema=_CONFIRMATION)
            return types.InputRequiredResult(
                input_requests={"confirm": types.ElicitRequest(params=form)},
                request_state=self._questions.new(asked.about),
            )
        except OvitaError as error:
            return _failed(str(error))
        except Exception:
            _log.exception("request %s", caller.request)
            return _failed(f"something went wrong in ovita; its log has request {caller.request}")
        return _result(outcome)

    async def _list_resources(self, ctx: Any, params: Any) -> Any:
        import mcp_types as types

        return types.ListResourcesResult(resources=[])

    async def _list_templates(self, ctx: Any, params: Any) -> Any:
        import mcp_types as types

        templates = [
            types.ResourceTemplate(
                name=name, uri_template=ADDRESS.replace("{name}", name), mime_type=kind, description=_HELD[name]
            )
            for name, kind in RESOURCES.items()
        ]
        return types.ListResourceTemplatesResult(resource_templates=templates)

    async def _read_resource(self, ctx: Any, params: Any) -> Any:
        import mcp_types as types
        from mcp.shared.exceptions import MCPError

        caller = self._caller(ctx, params)
        uri = str(params.uri)

        def read() -> str | bytes:
            with self.application.logged(caller, f"read {name}", {"task": task, "turn": turn}):
                return self.application.resource(caller, task, turn, name)

        try:
            task, turn, name = _parsed(uri)
            content = await self.work(read)
        except OvitaError as error:
            raise MCPError(code=types.INVALID_PARAMS, message=str(error)) from None
        kind = RESOURCES[name]
        if isinstance(content, bytes):
            blob = base64.b64encode(content).decode()
            held: Any = types.BlobResourceContents(uri=uri, mime_type=kind, blob=blob)
        else:
            held = types.TextResourceContents(uri=uri, mime_type=kind, text=content)
        return types.ReadResourceResult(contents=[held])

    def _caller(self, ctx: Any, params: Any) -> Caller:
        known = ctx.session.client_params
        client = "unknown" if known is None else f"{known.client_info.name} {known.client_info.version}"
        transport: Transport = "stdio" if ctx.request is None else "http"
        asks = self._asker(ctx, params) if _can_ask(ctx) else None
        owner = "local" if ctx.request is None else str(ctx.request.scope[SERVE_OWNER])
        return Caller(owner, one_line(client, 80), transport, ask=asks)

    def _asker(self, ctx: Any, params: Any) -> Callable[[str, str], str]:
        """How a person is asked: in the middle of the call, or since protocol 2026-07-28 between two tries of it."""
        from mcp_types.version import MODERN_PROTOCOL_VERSIONS

        if ctx.protocol_version not in MODERN_PROTOCOL_VERSIONS:
            return functools.partial(_asked, ctx)
        brought = (getattr(params, "input_responses", None) or {}).get("confirm")
        asked_about = self._questions.take(params.request_state or "") if brought is not None else None

        def answered(question: str, about: str) -> str:
            if asked_about != about:
                raise Unanswered(question, about)
            return _agreement(brought)

        return answered


class OpenQuestions:
    """Questions that people have not answered yet; each is answered once, so that no answer can be sent again."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._about: dict[str, str] = {}

    def new(self, about: str) -> str:
        """A name for a question about something; of too many, the oldest is forgotten."""
        name = secrets.token_hex(16)
        with self._lock:
            self._about[name] = about
            if len(self._about) > MOST_QUESTIONS:
                del self._about[next(iter(self._about))]
        return name

    def take(self, name: str) -> str | None:
        """What the question of a name was about; from now on it is none."""
        with self._lock:
            return self._about.pop(name, None)


_HELD = {
    "path.csv": "The path after a turn (x, y, z in m, speed in m/s); turn 0 is the path as it was opened",
    "before.csv": "The path that a turn began with",
    "result.json": "The whole result of a turn, as ovita adapt --out writes it",
    "scene.json": "The scene of a task",
    "picture.png": "The path of a turn, before and after",
}


def _can_ask(ctx: Any) -> bool:
    """Whether the client says that it shows forms to a person."""
    known = ctx.session.client_capabilities
    offered = None if known is None else known.elicitation
    return offered is not None and (offered.form is not None or offered.url is None)


def _asked(ctx: Any, question: str, about: str) -> str:
    """Ask from a worker thread and wait for the answer."""
    import anyio
    import anyio.from_thread
    from mcp.shared.exceptions import MCPError

    async def ask() -> Any:
        with anyio.fail_after(ANSWER_WITHIN):
            return await ctx.session.elicit_form(question, _CONFIRMATION, ctx.request_id)

    try:
        return _agreement(anyio.from_thread.run(ask))
    except TimeoutError:
        return "cancel"
    except MCPError:
        raise RequestError("this client could not ask a person, and nothing is sent without one") from None


def _agreement(answer: Any) -> str:
    """The answer: to accept the form takes a yes in it."""
    content = answer.content or {}
    return answer.action if answer.action != "accept" or content.get("send") is True else "decline"


def _parsed(uri: str) -> tuple[str, int, str]:
    """The task, the turn and the name that a resource's address holds."""
    kind, _, rest = uri.partition("://")
    parts = rest.split("/")
    known = kind == "ovita" and len(parts) == 5 and parts[0] == "tasks" and parts[2] == "turns"
    if not known or not parts[3].isascii() or not parts[3].isdigit() or len(parts[3]) > 9 or parts[4] not in RESOURCES:
        raise RequestError(f"there is no {clean_text(uri, 80)}; a resource is {address_of('TASK', 0, 'path.csv')}")
    return parts[1], int(parts[3]), parts[4]


@functools.cache
def _tool(operation: Operation) -> Any:
    import mcp_types as types

    hints = types.ToolAnnotations(
        title=operation.title,
        read_only_hint=operation.read_only,
        destructive_hint=operation.destructive,
        idempotent_hint=operation.idempotent,
        open_world_hint=operation.name == "send",
    )
    return types.Tool(
        name=operation.name,
        title=operation.title,
        description=operation.about,
        input_schema=operation.takes.model_json_schema(),
        output_schema=operation.gives.model_json_schema(mode="serialization"),
        annotations=hints,
    )


def _result(outcome: ToolOutcome) -> Any:
    """A result with its structure, the same as text, and its picture."""
    import mcp_types as types

    structured = outcome.model_dump(mode="json")
    content: list[Any] = [types.TextContent(text=json.dumps(structured, ensure_ascii=False))]
    if isinstance(outcome, PictureReport):
        content.append(types.ImageContent(data=base64.b64encode(outcome.png).decode(), mime_type="image/png"))
    return types.CallToolResult(content=content, structured_content=structured)


def _failed(sentence: str) -> Any:
    import mcp_types as types

    return types.CallToolResult(content=[types.TextContent(text=clean_text(sentence, 1_000))], is_error=True)
