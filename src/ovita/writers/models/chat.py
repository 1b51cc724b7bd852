"""The writer that asks a language model, through pydantic-ai: cloud, self-hosted, or any OpenAI-compatible server."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ovita.errors import RequestError, WriterError
from ovita.writers.models.endpoint import ModelEndpoint, rejects_schema, rejects_temperature, retry_delay, writer_error
from ovita.writers.models.exchange import Answer, Exchange, Form, ModelRequest, ModelWriter
from ovita.writers.progress import WritingBudget

if TYPE_CHECKING:
    import httpx2
    from pydantic_ai.messages import ModelMessage, ModelResponse
    from pydantic_ai.models import Model, ModelRequestParameters
    from pydantic_ai.settings import ModelSettings

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
    ) -> None:
        if not 0.0 <= temperature <= 2.0:
            raise RequestError(f"the temperature {temperature:g} is out of range; use 0 to 2")
        if not 0.0 < timeout < float("inf"):
            raise RequestError(f"the timeout {timeout:g} cannot be used; give a positive number of seconds")
        if retries < 0 or max_tokens < 1:
            raise RequestError("retries must be 0 or more and max_tokens 1 or more")
        self._endpoint = ModelEndpoint.named(name, base_url, api_key)
        form: Form = "tool" if self._endpoint.provider == "anthropic" else "native"
        super().__init__(name.strip(), form, temperature, max_tokens)
        self._timeout, self._retries = timeout, retries

    def shown(self, text: str) -> str:
        """Return a model's text on one line, shortened and without keys, for a message."""
        return self._endpoint.scrubbed(text, "")

    def exchange(self, ask: ModelRequest, budget: WritingBudget) -> Exchange:
        """Send a request to the model and return its raw answer.

        Raises:
            MissingKey: If the provider needs a key and none is set; nothing was sent.
            WriterError: If there was no answer, for example because the time was up.
        """
        key = self._endpoint.key(self._name)
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
        waiting = f"{self._name} is asked"
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
            return writer_error(error, self._endpoint, self._name, key)

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
                if ask.temperature is not None and rejects_temperature(error):
                    ask, tries = replace(ask, temperature=None), tries - 1
                    continue
                if ask.form != "text" and rejects_schema(error):
                    ask, tries = replace(ask, form="text"), tries - 1
                    continue
                delay = retry_delay(error, tries)
                late = delay is not None and asyncio.get_running_loop().time() + delay >= deadline
                if delay is None or late or tries > self._retries:
                    return writer_error(error, self._endpoint, self._name, key, tries=tries)
                await asyncio.sleep(delay)


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

    messages: list[ModelMessage] = [
        wire.ModelResponse(parts=[wire.TextPart(turn)])
        if i % 2
        else wire.ModelRequest(parts=[wire.UserPromptPart(turn)])
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

    instructions = [InstructionPart(content=ask.system)]
    schema, about = Answer.model_json_schema(), Answer.__doc__
    if ask.form == "native":
        wanted = OutputObjectDefinition(json_schema=schema, name="answer", description=about)
        return ModelRequestParameters(
            output_mode="native", output_object=wanted, allow_text_output=True, instruction_parts=instructions
        )
    if ask.form == "tool":
        tool = ToolDefinition(name="answer", parameters_json_schema=schema, description=about, kind="output")
        return ModelRequestParameters(
            output_mode="tool", output_tools=[tool], allow_text_output=False, instruction_parts=instructions
        )
    return ModelRequestParameters(instruction_parts=instructions)


def _exchange(response: ModelResponse, ask: ModelRequest, model: str) -> Exchange:
    from pydantic_ai.messages import TextPart, ToolCallPart

    calls = [part for part in response.parts if isinstance(part, ToolCallPart)]
    text = "\n".join(part.content for part in response.parts if isinstance(part, TextPart))
    arguments = calls[0].args_as_dict() if calls else None
    refusal = None
    if response.finish_reason == "content_filter":
        refusal = str((response.provider_details or {}).get("refusal", "") or text)
    return Exchange(
        ask=ask,
        model=response.model_name or model,
        text=text or (calls[0].args_as_json_str() if calls else ""),
        arguments=arguments,
        truncated=response.finish_reason == "length",
        refusal=refusal,
        input_tokens=response.usage.input_tokens,
        output_tokens=response.usage.output_tokens,
    )
