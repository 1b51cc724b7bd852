"""HTTP: MCP under /mcp and REST under /v1 behind one door that asks every request for its host, token and size."""

from __future__ import annotations

import asyncio
import json
import logging
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.metadata import version
from typing import Any

from ovita.errors import InputError, MissingExtra, OvitaError, RequestError
from ovita.serve.access import BearerTokens, Caller, HostNames, NotAllowed, TooManyRequests, one_line
from ovita.serve.application import RESOURCES, Application
from ovita.serve.operations import INSTRUCTIONS, OPERATIONS, Operation, perform
from ovita.serve.protocol import SERVE_OWNER, ToolServer
from ovita.serve.tasks import NoSuchTask
from ovita.text import clean_text, sentence

OPEN = ("/", "/openapi.json")
"""What is answered without a token: the description of the interface, which holds nothing of anybody."""

SESSIONS = 200
"""Most MCP sessions at a time."""

CONNECTIONS = 500
"""Most connections at a time."""

_WRONG_TOKEN_DELAY = 0.5
_RESOURCE_PATH = "/v1/tasks/{task}/turns/{turn}/{name}"
_log = logging.getLogger("ovita.serve")


@dataclass(frozen=True)
class Door:
    """The checks on every request, as an ASGI application around another.

    Args:
        most: Largest request [bytes].
    """

    inner: Any
    tokens: BearerTokens
    hosts: HostNames
    most: int

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Refuse a request or pass it on with its owner."""
        if scope["type"] == "lifespan":
            await self.inner(scope, receive, send)
        elif scope["type"] != "http":
            await send({"type": "websocket.close", "code": 1008})
        else:
            headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
            answer = await self._refusal(scope, headers)
            if answer is None and scope["method"] not in ("GET", "DELETE"):
                body = await _body(headers.get("content-length", ""), receive, self.most)
                receive = _again(body or b"", receive)
                if body is None:
                    answer = _answer(413, f"the request is larger than {self.most} bytes, the most allowed")
            await (answer or self.inner)(scope, receive, send)

    async def _refusal(self, scope: Any, headers: Mapping[str, str]) -> Any:
        """The answer to a request that may not come in, or None; otherwise the scope says whose it is."""
        refusal = self.hosts.refusal(headers.get("host", ""), headers.get("origin"))
        if refusal:
            return _answer(403, refusal)
        scope[SERVE_OWNER] = self.tokens.owner(headers.get("authorization", ""))
        if scope[SERVE_OWNER] is not None or scope["path"] in OPEN:
            return None
        await asyncio.sleep(_WRONG_TOKEN_DELAY)
        said = _answer(401, "bring the token that the server printed: Authorization: Bearer TOKEN")
        said.headers["WWW-Authenticate"] = "Bearer"
        return said


async def _body(declared: str, receive: Any, most: int) -> bytes | None:
    """The whole body of a request, or None if it is larger than `most`."""
    if declared.isdigit() and int(declared[:20]) > most:
        return None
    body, more = b"", True
    while more:
        message = await receive()
        body += message.get("body", b"")
        more = bool(message.get("more_body", False))
        if len(body) > most:
            return None
    return body


def _again(body: bytes, receive: Any) -> Any:
    """A body that was read, to be read once more; then what comes after it."""
    left = [{"type": "http.request", "body": body, "more_body": False}]

    async def replay() -> Any:
        return left.pop() if left else await receive()

    return replay


def _answer(status: int, problem: str, **more: object) -> Any:
    from starlette.responses import JSONResponse

    return JSONResponse({"error": clean_text(problem, 1_000), **more}, status)


class RestInterface:
    """The tools as REST."""

    def __init__(self, application: Application, tools: ToolServer) -> None:
        self.application, self.tools = application, tools

    def routes(self) -> list[Any]:
        """Every path with what answers it."""
        from starlette.responses import HTMLResponse, JSONResponse
        from starlette.routing import Route

        async def page(request: Any) -> Any:
            policy = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'"
            return HTMLResponse(interface_page(), headers={"Content-Security-Policy": policy})

        async def document(request: Any) -> Any:
            return JSONResponse(openapi())

        async def unknown(request: Any) -> Any:
            return _answer(404, "there is no such path for this method; the page under / lists them all")

        return [
            Route("/", page),
            Route("/openapi.json", document),
            Route(_RESOURCE_PATH.replace("{turn}", "{turn:int}"), self._resource),
            *(Route(o.path, self._endpoint(o), methods=[o.method]) for o in OPERATIONS.values()),
            Route("/{rest:path}", unknown, methods=["GET", "POST", "PUT", "PATCH", "DELETE"]),
        ]

    def _endpoint(self, operation: Operation) -> Any:
        async def endpoint(request: Any) -> Any:
            body = await request.body()

            def done() -> Any:
                given = _object(body) | dict(request.path_params)
                return perform(self.application, operation.name, given, _caller(request), len(body))

            return await self._answered(request, done)

        return endpoint

    async def _resource(self, request: Any) -> Any:
        caller, at = _caller(request), request.path_params

        def read() -> Any:
            with self.application.logged(caller, f"read {clean_text(at['name'], 40)}", at):
                return self.application.resource(caller, at["task"], at["turn"], at["name"])

        return await self._answered(request, read, RESOURCES.get(at["name"], ""))

    async def _answered(self, request: Any, do: Any, kind: str = "") -> Any:
        """What a call gives, as a response; an error as its status and one sentence."""
        from starlette.responses import JSONResponse, Response

        try:
            found = await self.tools.work(do)
        except TooManyRequests as error:
            said = _answer(429, str(error))
            said.headers["Retry-After"] = f"{error.wait:.0f}"
            return said
        except OvitaError as error:
            return _answer(_status_of(error), str(error))
        except Exception:
            _log.exception("%s", request.url.path)
            return _answer(500, "something went wrong in ovita; its log has the request")
        return Response(found, media_type=kind) if kind else JSONResponse(found.model_dump(mode="json"))


def _status_of(error: OvitaError) -> int:
    kinds: Mapping[type[OvitaError], int] = {NoSuchTask: 404, NotAllowed: 403, MissingExtra: 501, InputError: 422}
    return next((status for kind, status in kinds.items() if isinstance(error, kind)), 400)


def _object(body: bytes) -> dict[str, Any]:
    try:
        value = json.loads(body) if body.strip() else {}
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise RequestError("the body of a request is a JSON object")
    return value


def _caller(request: Any) -> Caller:
    client = one_line(request.headers.get("user-agent", "unknown"), 80)
    return Caller(request.scope[SERVE_OWNER], client, "rest")


@cache
def openapi() -> dict[str, Any]:
    """The interface as an OpenAPI 3.1 document, from the same models as the tools."""
    from pydantic.json_schema import models_json_schema

    models: list[tuple[Any, Any]] = [(o.takes, "validation") for o in OPERATIONS.values()]
    models += [(o.gives, "serialization") for o in OPERATIONS.values()]
    refs, schemas = models_json_schema(models, ref_template="#/components/schemas/{model}")
    paths: dict[str, Any] = {}
    for operation in OPERATIONS.values():
        given, made = refs[operation.takes, "validation"], refs[operation.gives, "serialization"]
        named = [_parameter("task", "string")] if "{task}" in operation.path else []
        entry: dict[str, Any] = {
            "operationId": operation.name,
            "summary": operation.title,
            "description": operation.about,
            "parameters": named,
            "responses": {"200": _json("The result", made), "default": _json("What is wrong", _ERROR)},
        }
        if operation.method == "POST":
            known = schemas["$defs"][str(given["$ref"]).rpartition("/")[2]]
            entry["requestBody"] = {"required": True, "content": {"application/json": {"schema": _bodied(known)}}}
        paths.setdefault(operation.path, {})[operation.method.lower()] = entry
    kinds: dict[str, Any] = {kind: {} for kind in dict.fromkeys(RESOURCES.values())}
    paths[_RESOURCE_PATH] = {
        "get": {
            "operationId": "read_resource",
            "summary": "Read a trajectory, a result, the scene or a picture",
            "parameters": [
                _parameter("task", "string"),
                _parameter("turn", "integer"),
                {**_parameter("name", "string"), "schema": {"type": "string", "enum": [*RESOURCES]}},
            ],
            "responses": {"200": {"description": "The content", "content": kinds}},
        }
    }
    return {
        "openapi": "3.1.0",
        "info": {"title": "ovita", "version": version("ovita"), "description": INSTRUCTIONS},
        "security": [{"bearer": []}],
        "paths": paths,
        "components": {
            "schemas": schemas["$defs"],
            "securitySchemes": {"bearer": {"type": "http", "scheme": "bearer"}},
        },
    }


_ERROR = {"type": "object", "properties": {"error": {"type": "string"}}, "required": ["error"]}


def _bodied(schema: Mapping[str, Any]) -> dict[str, Any]:
    """The schema of a body, without the task, which the path names."""
    properties = {key: value for key, value in schema.get("properties", {}).items() if key != "task"}
    required = [key for key in schema.get("required", ()) if key != "task"]
    return {**schema, "properties": properties, "required": required}


def _parameter(name: str, kind: str) -> dict[str, Any]:
    return {"name": name, "in": "path", "required": True, "schema": {"type": kind}}


def _json(description: str, schema: object) -> dict[str, Any]:
    return {"description": description, "content": {"application/json": {"schema": schema}}}


@cache
def interface_page() -> str:
    """The interface as a page without scripts, which loads nothing from anywhere."""
    document = openapi()
    parts = [_STYLE, "<h1>ovita</h1>", *(f"<p>{escape(text)}</p>" for text in INSTRUCTIONS.split("\n\n"))]
    parts.append('<p>The same for programs: <a href="/openapi.json">openapi.json</a>. Every request but for this page')
    parts.append("brings <code>Authorization: Bearer TOKEN</code>. MCP is under <code>/mcp</code>.</p>")
    for path, methods in document["paths"].items():
        for method, entry in methods.items():
            parts.append(f"<h2><b>{method.upper()}</b> {escape(path)}</h2><p>{escape(entry['summary'])}. ")
            parts.append(f"{escape(entry.get('description', ''))}</p>")
            body = entry.get("requestBody")
            if body:
                parts.append(_table(body["content"]["application/json"]["schema"]))
    return "\n".join(parts)


def _table(schema: Mapping[str, Any]) -> str:
    rows = [
        f"<tr><td><code>{escape(name)}</code></td><td>{'required' if name in schema['required'] else ''}</td>"
        f"<td>{escape(sentence(known['description']) if 'description' in known else '')}</td></tr>"
        for name, known in schema["properties"].items()
    ]
    return f"<table>{''.join(rows)}</table>" if rows else ""


_STYLE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>ovita: interface</title><style>
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1d2733}
h2{font-size:1.05rem;margin:2rem 0 0;font-family:ui-monospace,monospace}h2 b{color:#1763a6}
td{padding:.2rem 1rem .2rem 0;vertical-align:top}p{margin:.4rem 0}</style>"""


def web_application(application: Application, tokens: BearerTokens, hosts: HostNames) -> Any:
    """The whole HTTP server as an ASGI application."""
    tools = ToolServer(application)
    rest = RestInterface(application, tools)
    most = application.rules.request_bytes
    inner = tools.server.streamable_http_app(
        streamable_http_path="/mcp",
        json_response=False,
        max_request_body_size=most,
        session_idle_timeout=min(application.rules.idle, 3_600.0),
        max_sessions=SESSIONS,
        custom_starlette_routes=rest.routes(),
        host="",
    )
    return Door(inner, tokens, hosts, most)


def listening(host: str, port: int) -> socket.socket:
    """A socket that listens on an address.

    Raises:
        RequestError: If it is taken or cannot be used.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host.strip("[]"), port))
        listener.listen(128)
    except OSError as error:
        listener.close()
        why = (error.strerror or str(error)).lower()
        raise RequestError(
            f"{host}:{port} cannot be used ({why}); choose another --port, 0 takes any free one"
        ) from None
    return listener


def serve(app: Any, listener: socket.socket) -> None:
    """Answer requests until the process is told to stop."""
    import uvicorn

    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=3,
        limit_concurrency=CONNECTIONS,
    )
    uvicorn.Server(config).run(sockets=[listener])
