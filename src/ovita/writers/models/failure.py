"""What went wrong with a request to a language model: whether to try again, and one sentence for a person."""

from __future__ import annotations

from ovita.errors import WriterError
from ovita.writers.models.endpoint import NO_KEY, Endpoint

BACKOFF = 0.5
"""Wait before the first retry when the server names none; it doubles with each one [s]."""

_SCHEMA_WORDS = ("response_format", "json_schema", "schema", "grammar", "structured", "tool", "json mode")

# What a client raises when an answer lacks what it takes for granted, such as a first choice.
_MISREAD = LookupError | TypeError | ValueError | AttributeError


def rejects_temperature(error: Exception) -> bool:
    """Whether the server refused the request because of its temperature."""
    return _status(error) in (400, 422) and "temperature" in _details(error)


def rejects_schema(error: Exception) -> bool:
    """Whether the server refused the request because of the JSON schema or the tool that goes with it."""
    return _status(error) in (400, 404, 422, 500, 501) and any(word in _details(error) for word in _SCHEMA_WORDS)


def retry_delay(error: Exception, tries: int) -> float | None:
    """Return how long to wait before the request is sent again [s], or None if that would not help.

    Args:
        error: What the request failed with.
        tries: How many times it was sent so far.
    """
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


def writer_error(error: Exception, endpoint: Endpoint, name: str, key: str, *, tries: int = 1) -> WriterError:
    """Return what went wrong as a sentence that names the writer and the remedy, and never the key."""
    from pydantic_ai import exceptions as failures

    if isinstance(error, failures.ModelHTTPError):
        sentence = _http_sentence(error, endpoint, key, tries)
    elif isinstance(error, failures.ModelConnectionError):
        sentence = f"no answer from {endpoint.address}: start the server, or check the address and the connection"
    elif isinstance(error, failures.ModelAPIError | failures.UnexpectedModelBehavior | _MISREAD):
        sentence = (
            f"{endpoint.address} answered with something that no chat model answers with;"
            " check that the address is that of an OpenAI-compatible server, with its /v1"
            if endpoint.base_url
            else f"{endpoint.address} answered with something unreadable; try again"
        )
    elif isinstance(error, failures.UserError):
        sentence = f"it cannot be used as a writer: {endpoint.scrubbed(str(error), key)}"
    elif type(error).__name__ in ("ConnectError", "ConnectTimeout"):  # of whichever client library asked
        sentence = f"no answer from {endpoint.address}: start the server, or check the address and the connection"
    else:
        detail = endpoint.scrubbed(str(error), key)
        sentence = f"the request failed ({type(error).__name__}{f': {detail}' if detail else ''}); try again"
    return WriterError(f"{name}: {sentence}")


def _http_sentence(error: Exception, endpoint: Endpoint, key: str, tries: int) -> str:
    from pydantic_ai import exceptions as failures

    assert isinstance(error, failures.ModelHTTPError)
    status, where = error.status_code, endpoint.address
    times = "" if tries == 1 else f" {tries} times"
    if isinstance(error, failures.ModelAuthenticationError) or status in (401, 403):
        if key == NO_KEY:
            return f"{where} wants an API key ({status}): set {endpoint.key_variable}"
        return f"{where} refused the API key ({status}): check {endpoint.key_variable}"
    if isinstance(error, failures.ModelNotFoundError) or status == 404:
        meant = f"; did it mean {error.suggested_model_id}?" if error.suggested_model_id else ""
        address = ", and that the address ends as the server wants it, often in /v1" if endpoint.base_url else ""
        return f"{where} knows no such model (404){meant}: check the model's name{address}"
    if isinstance(error, failures.ModelQuotaExceededError):
        return f"the account at {where} has no quota left ({status}): check its plan, or use --writer builtin"
    if status == 429:
        wait = f", and asks to wait {error.retry_after:.0f} s" if error.retry_after else ""
        return f"{where} limits the rate of requests (429){times}{wait}: try again later, or use --writer builtin"
    if isinstance(error, failures.ModelContextWindowExceededError):
        return "the prompt is longer than this model can read: use a model, or a server setting, with a longer context"
    if status >= 500:
        return f"{where} failed{times} with status {status}: try again later, or use --writer builtin"
    detail = endpoint.scrubbed(_message(error.body), key)
    return (
        f"{where} refused the request ({status}){f': {detail}' if detail else ''}; check the model's name and options"
    )


def _status(error: Exception) -> int:
    status = getattr(error, "status_code", 0)
    return status if isinstance(status, int) else 0


def _details(error: Exception) -> str:
    return str(getattr(error, "body", "")).lower()


def _message(body: object) -> str:
    if isinstance(body, dict):
        inner = body.get("error", body)
        body = inner.get("message", "") if isinstance(inner, dict) else inner
    return body if isinstance(body, str) else ""
