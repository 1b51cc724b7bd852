"""The writer that asks a language model, through pydantic-ai: cloud, self-hosted, or any OpenAI-compatible server."""

from __future__ import annotations

import asyncio
import ipaddress
import os
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Literal
from urllib.parse import urlsplit, urlunsplit

from ovita.errors import MissingExtra, MissingKey, RequestError, WriterError, WriterFailure
from ovita.writers.base import WritingBudget
from ovita.writers.models.exchange import (
    LARGE_FROM,
    Answer,
    Exchange,
    Form,
    ModelRequest,
    ModelWriter,
    billions,
    on_one_line,
)

if TYPE_CHECKING:
    import httpx2
    from pydantic_ai.exceptions import ModelHTTPError
    from pydantic_ai.messages import ModelMessage, ModelResponse, UserContent
    from pydantic_ai.models import Model, ModelRequestParameters
    from pydantic_ai.settings import ModelSettings

BUILTIN = "--writer builtin"
"""The option that asks for the writer without a model."""

THINKING_TOKENS = 12_000
"""What a model that thinks before it answers may write on top of the answer [tokens]."""


class LLMWriter(ModelWriter):
    """A language model as a policy writer.

    Args:
        name: "openai:MODEL", "anthropic:MODEL", "google:MODEL" or "ollama:MODEL"; with `base_url` a model's name alone
            will do, and "auto" takes the first model that the server lists.
        base_url: Address of an OpenAI-compatible server, such as "http://127.0.0.1:8080/v1".
        temperature: Sampling temperature; left out for models that accept none.
        timeout: Longest wait for an answer, retries included [s].
        retries: How often a request that failed at the server is sent again.
        api_key: Key; None takes it from the environment when a request is made.
        max_tokens: Longest answer [tokens].
        instead: The option that does without a model, for messages.

    Raises:
        RequestError: If the name, the address or an option cannot be used.
        MissingExtra: If pydantic-ai or the provider's package is not installed.
    """

    def __init__(
        self,
        name: str,
        *,
        base_url: str | None = None,
        temperature: float = 0.1,
        timeout: float = 60.0,
        retries: int = 2,
        api_key: str | None = None,
        max_tokens: int = 4096,
        instead: str = BUILTIN,
    ) -> None:
        if not 0.0 < timeout < float("inf"):
            raise RequestError(f"the timeout {timeout:g} cannot be used; give a positive number of seconds")
        if retries < 0 or max_tokens < 1:
            raise RequestError("retries must be 0 or more and max_tokens 1 or more")
        self._endpoint = replace(ModelEndpoint.named(name, base_url, api_key), instead=instead)
        form: Form = "tool" if self._endpoint.provider == "anthropic" else "native"
        super().__init__(name.strip(), form, temperature, max_tokens)
        self._timeout, self._retries = timeout, retries
        by_name = billions(self._endpoint.model)
        self._large = not self._endpoint.nearby if by_name is None else by_name >= LARGE_FROM

    def shown(self, text: str) -> str:
        """Return a model's text on one line, shortened and without keys, for a message."""
        return self._endpoint.scrubbed(text, "")

    def exchange(self, ask: ModelRequest, budget: WritingBudget) -> Exchange:
        """Send a request to the model and return its raw answer.

        Raises:
            MissingKey: If the provider needs a key and none is set; nothing was sent.
            WriterError: If there was no answer, for example because the time was up.
        """
        key = self._endpoint.key(self.name)
        import pydantic_ai.direct  # noqa: F401  (2 s, not part of the time that an answer may take)

        seconds = min(self._timeout, budget.left)
        ends: list[Callable[[], object]] = []

        async def asked() -> Exchange | WriterError | None:
            task, loop = asyncio.current_task(), asyncio.get_running_loop()
            assert task is not None
            ends.append(lambda: loop.call_soon_threadsafe(task.cancel))
            return await self._within_time(ask, key, seconds)

        def stop() -> None:
            for end in ends:
                with suppress(RuntimeError):  # the loop has closed by itself
                    end()

        # A loop of its own, so that callers inside a running loop can wait for it. The margin is for when looking up
        # the server's name hangs, which nothing can interrupt.
        waiting = f"{self.name} is asked"
        outcome = budget.wait_for(lambda: asyncio.run(asked()), stop, seconds + 2.0, waiting)
        if isinstance(outcome, WriterError):
            raise outcome
        if outcome is None:
            late = f"no answer within {seconds:.3g} s; allow more time or use a faster model"
            raise self._no_answer(late, budget)
        return outcome

    async def _within_time(self, ask: ModelRequest, key: str, seconds: float) -> Exchange | WriterError | None:
        import httpx2

        # Proxies do not stand before servers on this machine, whatever the environment says.
        client = httpx2.AsyncClient(timeout=seconds, follow_redirects=True, trust_env=not self._endpoint.local)
        try:
            async with asyncio.timeout(seconds), client:
                name = self._endpoint.model or await _first_model(client, self._endpoint, key)
                return await self._persist(self._endpoint.open(name, key, client), ask, key, seconds)
        except TimeoutError:
            return None
        except Exception as error:  # whatever a third-party client raises, a person gets a sentence
            return writer_error(error, self._endpoint, self.name, key)

    async def _persist(self, model: Model, ask: ModelRequest, key: str, seconds: float) -> Exchange | WriterError:
        """Retry until there is an answer, dropping options that the server refuses."""
        from pydantic_ai.exceptions import ModelAPIError

        ask, tries = _suited(ask, model), 0
        deadline = asyncio.get_running_loop().time() + seconds
        while True:
            tries += 1
            try:
                return await _request(model, ask)
            except ModelAPIError as error:
                status, said = _status(error), str(getattr(error, "body", "")).lower()
                plainer = _without_refused(ask, status, said)
                if plainer is not None:
                    ask, tries = plainer, tries - 1
                    continue
                delay = retry_delay(error, tries)
                late = delay is not None and asyncio.get_running_loop().time() + delay >= deadline
                if delay is None or late or tries > self._retries:
                    return writer_error(error, self._endpoint, self.name, key, tries=tries)
                await asyncio.sleep(delay)


def _without_refused(ask: ModelRequest, status: int, said: str) -> ModelRequest | None:
    """The request without the option that the server refused, or None where that is not what it says."""
    if ask.temperature is not None and status in (400, 422) and "temperature" in said:
        return replace(ask, temperature=None)
    if ask.form != "text" and status in _NO_SCHEMA and any(word in said for word in _SCHEMA_WORDS):
        return replace(ask, form="text")
    return None


async def _first_model(client: httpx2.AsyncClient, endpoint: ModelEndpoint, key: str) -> str:
    """Return the first model a server lists, or "default"."""
    answer = await client.get(f"{endpoint.base_url}/models", headers={"Authorization": f"Bearer {key}"})
    try:
        return str(answer.json()["data"][0]["id"])
    except (ValueError, LookupError, TypeError):
        return "default"


def _suited(ask: ModelRequest, model: Model) -> ModelRequest:
    """Fit a request to a model: form of answer, temperature, and reasoning budget."""
    profile: Mapping[str, Any] = model.profile
    if ask.form == "native" and not profile.get("supports_json_schema_output", False):
        ask = replace(ask, form="text")
    thinks = bool(profile.get("thinking_enabled_by_default") or profile.get("thinking_always_enabled"))
    if thinks:
        ask = replace(ask, max_tokens=ask.max_tokens + THINKING_TOKENS)
    if profile.get("anthropic_disallows_sampling_settings") or (profile.get("openai_supports_reasoning") and thinks):
        ask = replace(ask, temperature=None)
    return ask


async def _request(model: Model, ask: ModelRequest) -> Exchange:
    """Put a question to a model once.

    Raises:
        pydantic_ai.exceptions.ModelAPIError: If the request failed.
    """
    from pydantic_ai import messages as wire
    from pydantic_ai.direct import model_request

    pictures = [wire.BinaryContent(data=picture, media_type="image/png") for picture in ask.pictures]
    said: list[Sequence[UserContent]] = [[turn] for turn in ask.turns]
    said[-1] = [*pictures, *said[-1]]
    messages: list[ModelMessage] = [
        wire.ModelResponse(parts=[wire.TextPart(turn)])
        if i % 2
        else wire.ModelRequest(parts=[wire.UserPromptPart(said[i] if pictures else turn)])
        for i, turn in enumerate(ask.turns)
    ]
    settings: ModelSettings = {"max_tokens": ask.max_tokens, "max_retries": 0}
    if model.system == "google":
        del settings["max_retries"]
    if ask.temperature is not None:
        settings["temperature"] = ask.temperature
    parameters = _parameters(ask)
    # instrument=False: nothing of a person's scene goes to a tracing service, whatever else the process has set up.
    response = await model_request(
        model, messages, model_settings=settings, model_request_parameters=parameters, instrument=False
    )
    return _exchange(response, ask, model.model_name)


def _parameters(ask: ModelRequest) -> ModelRequestParameters:
    from pydantic_ai.messages import InstructionPart
    from pydantic_ai.models import ModelRequestParameters
    from pydantic_ai.output import OutputObjectDefinition
    from pydantic_ai.tools import ToolDefinition

    asked: dict[str, Any] = {}
    schema, about = Answer.model_json_schema(), Answer.__doc__
    if ask.form == "native":
        wanted = OutputObjectDefinition(json_schema=schema, name="answer", description=about)
        asked = {"output_mode": "native", "output_object": wanted, "allow_text_output": True}
    elif ask.form == "tool":
        tool = ToolDefinition(name="answer", parameters_json_schema=schema, description=about, kind="output")
        asked = {"output_mode": "tool", "output_tools": [tool], "allow_text_output": False}
    return ModelRequestParameters(instruction_parts=[InstructionPart(content=ask.system)], **asked)


def _exchange(response: ModelResponse, ask: ModelRequest, model: str) -> Exchange:
    from pydantic_ai.messages import TextPart, ToolCallPart

    calls = [part for part in response.parts if isinstance(part, ToolCallPart)]
    text = "\n".join(part.content for part in response.parts if isinstance(part, TextPart))
    arguments = calls[0].args_as_dict() if calls else None
    refusal = None
    if response.finish_reason == "content_filter":
        refusal = str((response.provider_details or {}).get("refusal", "") or text)
    return Exchange(
        ask,
        response.model_name or model,
        text or (calls[0].args_as_json_str() if calls else ""),
        arguments,
        response.finish_reason == "length",
        refusal,
        response.usage.input_tokens,
        response.usage.output_tokens,
    )


OLLAMA_PORT = 11434
NO_KEY = "no-key-needed"

Provider = Literal["openai", "anthropic", "google", "ollama", "compatible"]

_PROVIDERS: dict[Provider, tuple[str, tuple[str, ...]]] = {
    "openai": ("openai", ("OPENAI_API_KEY",)),
    "anthropic": ("anthropic", ("ANTHROPIC_API_KEY",)),
    "google": ("google.genai", ("GOOGLE_API_KEY", "GEMINI_API_KEY")),
    "ollama": ("openai", ("OLLAMA_API_KEY",)),
    "compatible": ("openai", ("OPENAI_API_KEY",)),
}
"""The package that speaks to each provider, and the environment variables of its key."""

_LOOKS_LIKE_KEY = re.compile(r"\b(?:sk|pk|key|AIza)[-_]?[A-Za-z0-9_*-]{12,}")


@dataclass(frozen=True)
class ModelEndpoint:
    """Where a model is reached.

    Args:
        provider: Which protocol is spoken; "compatible" is any OpenAI-compatible server.
        model: Model name; "" asks a compatible server for the first model that it lists.
        base_url: Address of the server; None is the provider's own.
        given_key: Key given by the caller; None takes it from the environment when a request is made.
        instead: The option that does without a model, for messages.
    """

    provider: Provider
    model: str
    base_url: str | None
    given_key: str | None = field(default=None, repr=False)
    instead: str = BUILTIN

    @classmethod
    def named(cls, name: str, base_url: str | None = None, api_key: str | None = None) -> ModelEndpoint:
        """Return the endpoint that a writer's name and an address stand for.

        Raises:
            RequestError: If the name or the address cannot be used.
            MissingExtra: If the packages that speak to it are not installed.
        """
        prefix, separator, rest = name.strip().partition(":")
        provider = next((known for known in _PROVIDERS if separator and known == prefix != "compatible"), None)
        model = rest.strip() if provider else name.strip()
        if base_url is None and provider == "openai":
            base_url = os.environ.get("OPENAI_BASE_URL") or None
        if base_url is not None:
            base_url = _checked(base_url)
            provider = "compatible" if provider in (None, "openai") else provider
            model = "" if model == "auto" else model
        elif provider == "ollama":
            base_url = ollama_url(os.environ.get("OLLAMA_HOST", ""))
        if provider is None or not (model or provider == "compatible"):
            raise RequestError(f"{name!r} names no model; write PROVIDER:MODEL, such as openai:gpt-5 or ollama:qwen3")
        for module, package in (("pydantic_ai", "pydantic-ai-slim"), (_PROVIDERS[provider][0],) * 2):
            if not _installed(module):
                raise MissingExtra(package, "llm")
        return cls(provider, model, base_url, api_key)

    @property
    def key_variable(self) -> str:
        """The environment variable that holds the key."""
        return _PROVIDERS[self.provider][1][0]

    @property
    def address(self) -> str:
        """The server as it may be shown: without user, password and query."""
        if self.base_url is None:
            return f"the {self.provider} service"
        parts = urlsplit(self.base_url)
        return urlunsplit((parts.scheme, parts.netloc.rpartition("@")[2], parts.path, "", ""))

    @property
    def local(self) -> bool:
        """Whether the server is on this machine, where no proxy applies."""
        host = urlsplit(self.base_url or "").hostname or ""
        try:
            return ipaddress.ip_address(host).is_loopback
        except ValueError:
            return host == "localhost" or host.endswith(".localhost")

    @property
    def nearby(self) -> bool:
        """Whether the model runs on a machine of one's own: by Ollama, or by a server on this machine."""
        return self.provider == "ollama" or self.local

    def key(self, writer: str) -> str:
        """Return the key, or a placeholder where none is needed.

        Raises:
            MissingKey: If one is needed and none is set.
        """
        candidates = (self.given_key, *(os.environ.get(variable) for variable in _PROVIDERS[self.provider][1]))
        key = next((candidate.strip() for candidate in candidates if candidate and candidate.strip()), "")
        if not key and self.provider in ("openai", "anthropic", "google"):
            raise MissingKey(writer, self.key_variable, self.instead)
        return key or NO_KEY

    def open(self, model: str, key: str, client: httpx2.AsyncClient) -> Model:
        """Return the pydantic-ai model that sends its requests through `client`."""
        from pydantic_ai.models import infer_model
        from pydantic_ai.providers import infer_provider_class

        if self.provider != "compatible":
            maker: Any = infer_provider_class(self.provider)
            kind = "openai-chat" if self.provider == "openai" else self.provider
            return infer_model(
                f"{kind}:{model}", lambda _: maker(api_key=key, base_url=self.base_url, http_client=client)
            )
        from pydantic_ai.models.openai import OpenAIChatModel
        from pydantic_ai.profiles.openai import OpenAIModelProfile
        from pydantic_ai.providers.openai_compatible import OpenAICompatibleProvider

        server = OpenAICompatibleProvider("compatible", base_url=self.base_url or "", api_key=key, http_client=client)
        # Older servers know only the older name of this setting.
        return OpenAIChatModel(
            model, provider=server, profile=OpenAIModelProfile(openai_chat_supports_max_completion_tokens=False)
        )

    def scrubbed(self, text: str, key: str) -> str:
        """Return the text on one line, shortened, without the key and without anything that looks like one."""
        line = " ".join(text.split())
        line = line.replace(key, "***") if key and key != NO_KEY else line
        return on_one_line(_LOOKS_LIKE_KEY.sub("***", line))


def ollama_url(host: str) -> str:
    """Return the URL given by OLLAMA_HOST as HOST, HOST:PORT, :PORT or a URL."""
    host = host.strip().rstrip("/")
    if "://" in host:
        return _checked(host) + ("" if host.endswith("/v1") else "/v1")
    name, _, port = host.rpartition(":") if ":" in host and not host.endswith("]") else (host, "", "")
    name = "127.0.0.1" if name in ("", "0.0.0.0", "[::]") else name
    return _checked(f"http://{name}:{port or OLLAMA_PORT}/v1")


def _checked(url: str) -> str:
    url = url.strip().rstrip("/")
    try:
        parts = urlsplit(url)
        usable = parts.scheme in ("http", "https") and bool(parts.hostname) and (parts.port or 1) > 0
    except ValueError:
        usable = False
    if not usable:
        raise RequestError("the address of the model's server cannot be used; write it as http://HOST:PORT/v1")
    return url


def _installed(package: str) -> bool:
    try:
        return find_spec(package) is not None
    except ModuleNotFoundError:
        return False


# What can go wrong there

BACKOFF = 0.5
"""Wait before the first retry when the server names none; it doubles with each one [s]."""

_NO_SCHEMA = (400, 404, 422, 500, 501)
_SCHEMA_WORDS = ("response_format", "json_schema", "schema", "grammar", "structured", "tool", "json mode")
"""How a server refuses a request because of the JSON schema, or of the tool that goes with it."""

# What a client raises when an answer lacks what it takes for granted, such as a first choice.
_UNCONNECTED = ("ConnectError", "ConnectTimeout")
_MISREAD = LookupError | TypeError | ValueError | AttributeError


def retry_delay(error: Exception, tries: int) -> float | None:
    """How long to wait before a request that was sent `tries` times is sent again [s]; None if that would not help."""
    from pydantic_ai import exceptions as failures

    if isinstance(error, failures.ModelQuotaExceededError):
        return None
    if isinstance(error, failures.ModelHTTPError):
        hint = error.provider_retry_hint
        again = error.status_code in (408, 409, 429) or error.status_code >= 500
        if not (again if hint is None else hint and error.status_code not in (401, 403)):
            return None
        return float(BACKOFF * 2 ** (tries - 1)) if error.retry_after is None else max(0.0, error.retry_after)
    if isinstance(error, failures.ModelConnectionError) and error.phase != "connect":
        return float(BACKOFF * 2 ** (tries - 1))
    return None


def writer_error(error: Exception, endpoint: ModelEndpoint, name: str, key: str, *, tries: int = 1) -> WriterError:
    """Return what went wrong as a sentence that names the writer and the remedy, and never the key."""
    failure, sentence = _diagnosis(error, endpoint, key, tries)
    return WriterError(f"{name}: {sentence}", failure)


def _diagnosis(error: Exception, endpoint: ModelEndpoint, key: str, tries: int) -> tuple[WriterFailure, str]:
    from pydantic_ai import exceptions as failures

    # The last two are those of whichever client library asked.
    unconnected = isinstance(error, failures.ModelConnectionError) or type(error).__name__ in _UNCONNECTED
    if isinstance(error, failures.ModelHTTPError):
        return _http_diagnosis(error, endpoint, key, tries)
    if unconnected:
        return (
            "no_answer",
            f"no answer from {endpoint.address}: start the server, or check the address and the connection",
        )
    if isinstance(error, failures.ModelAPIError | failures.UnexpectedModelBehavior | _MISREAD):
        return "other", (
            f"{endpoint.address} answered with something that no chat model answers with;"
            " check that the address is that of an OpenAI-compatible server, with its /v1"
            if endpoint.base_url
            else f"{endpoint.address} answered with something unreadable; try again"
        )
    detail = endpoint.scrubbed(str(error), key)
    if isinstance(error, failures.UserError):
        return "other", f"it cannot be used as a writer: {detail}"
    return "other", f"the request failed ({type(error).__name__}{f': {detail}' if detail else ''}); try again"


def _http_diagnosis(error: ModelHTTPError, endpoint: ModelEndpoint, key: str, tries: int) -> tuple[WriterFailure, str]:
    from pydantic_ai import exceptions as failures

    status, where, instead = error.status_code, endpoint.address, f"or use {endpoint.instead}"
    times = "" if tries == 1 else f" {tries} times"
    refused, use = ("wants an API key", "set") if key == NO_KEY else ("refused the API key", "check")
    guess = f"; did it mean {error.suggested_model_id}?" if error.suggested_model_id else ""
    address = ", and that the address ends as the server wants it, often in /v1" if endpoint.base_url else ""
    pause = f", and asks to wait {error.retry_after:.0f} s" if error.retry_after else ""
    detail = endpoint.scrubbed(_message(error.body), key)
    rows: tuple[tuple[type[Exception] | tuple[()], bool, WriterFailure, str], ...] = (
        (failures.ModelAuthenticationError, status in (401, 403), "no_access",
         f"{where} {refused} ({status}): {use} {endpoint.key_variable}"),
        (failures.ModelNotFoundError, status == 404, "no_access",
         f"{where} knows no such model (404){guess}: check the model's name{address}"),
        (failures.ModelQuotaExceededError, False, "no_access",
         f"the account at {where} has no quota left ({status}): check its plan, {instead}"),
        ((), status == 429, "overloaded",
         f"{where} limits the rate of requests (429){times}{pause}: try again later, {instead}"),
        (failures.ModelContextWindowExceededError, False, "other",
         "the prompt is longer than this model can read: use a model, or a server setting, with a longer context"),
        ((), status >= 500, "overloaded",
         f"{where} failed{times} with status {status}: try again later, {instead}"),
        (Exception, True, "other",
         f"{where} refused the request ({status}){detail and ': '}{detail}; check the model's name and options"),
    )  # fmt: skip
    return next((failure, said) for kind, so, failure, said in rows if so or isinstance(error, kind))


def _status(error: Exception) -> int:
    status = getattr(error, "status_code", 0)
    return status if isinstance(status, int) else 0


def _message(body: object) -> str:
    if isinstance(body, dict):
        inner = body.get("error", body)
        body = inner.get("message", "") if isinstance(inner, dict) else inner
    return body if isinstance(body, str) else ""
