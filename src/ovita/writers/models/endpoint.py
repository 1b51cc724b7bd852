"""Where a language model is reached: provider, model, address and key. Never shows the key."""

from __future__ import annotations

import ipaddress
import os
import re
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import TYPE_CHECKING, Literal
from urllib.parse import urlsplit, urlunsplit

from ovita.errors import MissingExtra, MissingKey, RequestError

if TYPE_CHECKING:
    import httpx2
    from pydantic_ai.models import Model

OLLAMA_PORT = 11434
NO_KEY = "no-key-needed"

Provider = Literal["openai", "anthropic", "google", "ollama", "compatible"]

_PREFIXES: dict[str, Provider] = {"openai": "openai", "anthropic": "anthropic", "google": "google", "ollama": "ollama"}
_KEYS: dict[Provider, tuple[str, ...]] = {
    "openai": ("OPENAI_API_KEY",),
    "anthropic": ("ANTHROPIC_API_KEY",),
    "google": ("GOOGLE_API_KEY", "GEMINI_API_KEY"),
    "ollama": ("OLLAMA_API_KEY",),
    "compatible": ("OPENAI_API_KEY",),
}
_PACKAGES: dict[Provider, str] = {
    "openai": "openai",
    "anthropic": "anthropic",
    "google": "google.genai",
    "ollama": "openai",
    "compatible": "openai",
}
_LOOKS_LIKE_KEY = re.compile(r"\b(?:sk|pk|key|AIza)[-_]?[A-Za-z0-9_*-]{12,}")


@dataclass(frozen=True)
class Endpoint:
    """Where a model is reached.

    Args:
        provider: Which protocol is spoken; "compatible" is any OpenAI-compatible server.
        model: Model name; "" asks a compatible server for the first model that it lists.
        base_url: Address of the server; None is the provider's own.
        given_key: Key given by the caller; None takes it from the environment when a request is made.
    """

    provider: Provider
    model: str
    base_url: str | None
    given_key: str | None = field(default=None, repr=False)

    @classmethod
    def named(cls, name: str, base_url: str | None = None, api_key: str | None = None) -> Endpoint:
        """Return the endpoint that a writer's name and an address stand for.

        Raises:
            RequestError: If the name or the address cannot be used.
            MissingExtra: If the packages that speak to it are not installed.
        """
        prefix, separator, rest = name.strip().partition(":")
        provider = _PREFIXES.get(prefix) if separator else None
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
        if find_spec("pydantic_ai") is None:
            raise MissingExtra("pydantic-ai-slim", "llm")
        if not _installed(_PACKAGES[provider]):
            raise MissingExtra(_PACKAGES[provider], "llm")
        return cls(provider, model, base_url, api_key)

    @property
    def key_variable(self) -> str:
        """The environment variable that holds the key."""
        return _KEYS[self.provider][0]

    @property
    def needs_key(self) -> bool:
        """Whether nothing is answered without a key."""
        return self.provider in ("openai", "anthropic", "google")

    @property
    def address(self) -> str:
        """The server as it may be shown: without user, password and query."""
        if self.base_url is None:
            return f"the {self.provider} service"
        parts = urlsplit(self.base_url)
        return urlunsplit((parts.scheme, parts.netloc.rpartition("@")[2], parts.path, "", ""))

    @property
    def local(self) -> bool:
        """Whether the server is this machine, which no proxy stands before."""
        host = urlsplit(self.base_url or "").hostname or ""
        try:
            return ipaddress.ip_address(host).is_loopback
        except ValueError:
            return host == "localhost" or host.endswith(".localhost")

    def key(self, writer: str) -> str:
        """Return the key, or a placeholder where none is needed.

        Raises:
            MissingKey: If one is needed and none is set.
        """
        candidates = (self.given_key, *(os.environ.get(variable) for variable in _KEYS[self.provider]))
        key = next((candidate.strip() for candidate in candidates if candidate and candidate.strip()), "")
        if not key and self.needs_key:
            raise MissingKey(writer, self.key_variable)
        return key or NO_KEY

    def open(self, model: str, key: str, client: httpx2.AsyncClient) -> Model:
        """Return the pydantic-ai model that sends its requests through `client`."""
        if self.provider == "anthropic":
            from pydantic_ai.models.anthropic import AnthropicModel
            from pydantic_ai.providers.anthropic import AnthropicProvider

            anthropic = AnthropicProvider(api_key=key, base_url=self.base_url, http_client=client)
            return AnthropicModel(model, provider=anthropic)
        if self.provider == "google":
            from pydantic_ai.models.google import GoogleModel
            from pydantic_ai.providers.google import GoogleProvider

            google = GoogleProvider(api_key=key, base_url=self.base_url, http_client=client)
            return GoogleModel(model, provider=google)
        from pydantic_ai.models.openai import OpenAIChatModel
        from pydantic_ai.providers.openai import OpenAIProvider

        if self.provider == "ollama":
            from pydantic_ai.models.ollama import OllamaModel
            from pydantic_ai.providers.ollama import OllamaProvider

            return OllamaModel(model, provider=OllamaProvider(self.base_url, key, http_client=client))
        if self.provider == "openai" or self.base_url is None:
            return OpenAIChatModel(model, provider=OpenAIProvider(api_key=key, http_client=client))
        from pydantic_ai.profiles.openai import OpenAIModelProfile
        from pydantic_ai.providers.openai_compatible import OpenAICompatibleProvider

        server = OpenAICompatibleProvider("compatible", base_url=self.base_url, api_key=key, http_client=client)
        # Older servers know only the older name of this setting.
        return OpenAIChatModel(
            model, provider=server, profile=OpenAIModelProfile(openai_chat_supports_max_completion_tokens=False)
        )

    def scrubbed(self, text: str, key: str) -> str:
        """Return the text on one line, shortened, without the key and without anything that looks like one."""
        line = " ".join(text.split())
        if key and key != NO_KEY:
            line = line.replace(key, "***")
        line = _LOOKS_LIKE_KEY.sub("***", line)
        return line if len(line) <= 200 else line[:197] + "..."


def ollama_url(host: str) -> str:
    """Return the address that OLLAMA_HOST stands for: HOST, HOST:PORT, :PORT or a URL."""
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
