"""One exchange with a language model: what is asked, how it is put to pydantic-ai, and what was heard.

pydantic-ai takes seconds to import, so it is imported inside functions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from ovita.writers.models.answer import Answer

if TYPE_CHECKING:
    from pydantic_ai.messages import ModelMessage, ModelResponse
    from pydantic_ai.models import Model, ModelRequestParameters
    from pydantic_ai.settings import ModelSettings

THINKING_TOKENS = 12_000
"""What a model that thinks before it answers may write on top of the answer [tokens]."""

Form = Literal["native", "tool", "text"]
"""How an answer is asked for: JSON that follows a schema, the arguments of a tool, or plain text."""


_FORM_NOTES: dict[Form, str] = {
    "native": (
        "Give the answer as one JSON object with the keys plan (list of steps), code (the whole Python source as one"
        " string, without fences), assumptions (list), contacts (list of object names), question (text or null) and"
        " not_understood (list of words). The examples show these contents one below the other."
    ),
    "tool": (
        "Give the answer by calling the tool `answer` once; `code` is the whole Python source, without fences."
        " The examples show its arguments one below the other."
    ),
    "text": (
        "Give the answer in the form of the examples: Plan, Code in one fenced block, Assumptions, Contacts."
        ' Instead of code you may write one line "Question: ..." or "Not understood: the words".'
    ),
}


def form_note(form: Form) -> str:
    """Return what a model is told about the form of its answer."""
    return _FORM_NOTES[form]


@dataclass(frozen=True)
class Ask:
    """One question to a model: instructions, the turns so far (person, model, person, ...) and how to answer."""

    instructions: str
    turns: tuple[str, ...]
    form: Form
    structured: bool
    temperature: float | None
    max_tokens: int


@dataclass(frozen=True)
class Heard:
    """What a model answered to a question, and how it was asked in the end."""

    ask: Ask
    model: str
    text: str
    arguments: dict[str, Any] | None
    truncated: bool
    refusal: str | None
    input_tokens: int
    output_tokens: int


def suited(ask: Ask, model: Model) -> Ask:
    """Fit a question to what is known of a model: its form of answer, temperature, and room for thoughts."""
    profile: Mapping[str, Any] = model.profile
    if ask.form == "native" and not profile.get("supports_json_schema_output", False):
        ask = replace(ask, form="text")
    thinks = bool(profile.get("thinking_enabled_by_default") or profile.get("thinking_always_enabled"))
    if thinks:
        ask = replace(ask, max_tokens=ask.max_tokens + THINKING_TOKENS)
    if profile.get("anthropic_disallows_sampling_settings") or (profile.get("openai_supports_reasoning") and thinks):
        ask = replace(ask, temperature=None)
    return ask


async def exchange(model: Model, ask: Ask) -> Heard:
    """Put a question to a model once.

    Raises:
        pydantic_ai.exceptions.ModelAPIError: If the request failed.
    """
    from pydantic_ai.direct import model_request
    from pydantic_ai.messages import ModelRequest, ModelResponse, TextPart, UserPromptPart

    messages: list[ModelMessage] = [
        ModelResponse(parts=[TextPart(turn)]) if i % 2 else ModelRequest(parts=[UserPromptPart(turn)])
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
    return _heard(response, ask, model.model_name)


def _parameters(ask: Ask) -> ModelRequestParameters:
    from pydantic_ai.messages import InstructionPart
    from pydantic_ai.models import ModelRequestParameters
    from pydantic_ai.output import OutputObjectDefinition
    from pydantic_ai.tools import ToolDefinition

    notes = (ask.instructions, _FORM_NOTES[ask.form]) if ask.structured else (ask.instructions,)
    instructions = [InstructionPart(content="\n".join(note.rstrip() for note in notes))]
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


def _heard(response: ModelResponse, ask: Ask, model: str) -> Heard:
    from pydantic_ai.messages import TextPart, ToolCallPart

    calls = [part for part in response.parts if isinstance(part, ToolCallPart)]
    text = "\n".join(part.content for part in response.parts if isinstance(part, TextPart))
    arguments = calls[0].args_as_dict() if calls else None
    refusal = None
    if response.finish_reason == "content_filter":
        refusal = str((response.provider_details or {}).get("refusal", "") or text)
    return Heard(
        ask=ask,
        model=response.model_name or model,
        text=text or (calls[0].args_as_json_str() if calls else ""),
        arguments=arguments,
        truncated=response.finish_reason == "length",
        refusal=refusal,
        input_tokens=response.usage.input_tokens,
        output_tokens=response.usage.output_tokens,
    )
