"""REST: the same tools under /v1, described by the same models; and docs/agents.md says what is so."""

import json
import runpy
from pathlib import Path

import httpx2
import pytest
from served import OTHER, TASK, TOKEN

from ovita.serve.operations import OPERATIONS
from ovita.serve.web import interface_page, openapi


@pytest.fixture
def http(server):
    with httpx2.Client(base_url=server.address, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=60) as client:
        yield client


def test_rest_does_what_the_tools_do(http, server):
    (server.folder / "in/task.json").write_text(json.dumps(TASK))
    task = http.post("/v1/tasks", json={"path": "task.json"}).json()["task"]
    made = http.post(f"/v1/tasks/{task}/adapt", json={"instruction": "go left by 0.2"}).json()
    assert made["status"] == "done" and made["changes"][0] == "The whole path moved 0.20 m left."
    assert http.post(f"/v1/tasks/{task}/knob", json={"name": "left", "value": 0.3}).json()["turn"] == 2
    assert http.post(f"/v1/tasks/{task}/check").json()["released"] is True
    rows = http.get(f"/v1/tasks/{task}/turns/2/path.csv").text.splitlines()
    assert rows[1] == "-0.3,0.0,0.3,0.3"
    assert http.get(f"/v1/tasks/{task}/turns/2/picture.png").content.startswith(b"\x89PNG")
    assert http.post(f"/v1/tasks/{task}/undo").json()["turn"] == 1
    sent = http.post(f"/v1/tasks/{task}/send", json={"to": str(server.folder / "robot.csv")})
    assert sent.status_code == 422 and "cannot ask a person" in sent.json()["error"]
    assert http.delete(f"/v1/tasks/{task}").json() == {"task": task}
    assert http.get(f"/v1/tasks/{task}").status_code == 404


@pytest.mark.parametrize(
    ("path", "body", "status", "problem"),
    [
        ("/v1/tasks", {}, 422, "give either path or document"),
        ("/v1/tasks", {"document": {"trajectory": 3}}, 422, "document: trajectory is 3"),
        ("/v1/tasks", {"documents": {}}, 422, "documents"),
        ("/v1/tasks", [1], 422, "a JSON object"),
        (
            "/v1/tasks",
            {"document": {**TASK, "robot": "/etc/robot.toml"}},
            403,
            "robot '/etc/robot.toml' is not allowed",
        ),
        ("/v1/tasks", {"document": {**TASK, "trajectory": [[i, 0, 0] for i in range(501)]}}, 403, "up to 500"),
        ("/v1/tasks/0123456789abcdef/adapt", {"instruction": "go left"}, 404, "no open task"),
        ("/v1/tasks/..%2f..%2fx/adapt", {"instruction": "go left"}, 404, ""),
    ],
)
def test_a_mistake_is_one_sentence_with_its_status(http, path, body, status, problem):
    answer = http.post(path, json=body)
    assert answer.status_code == status and problem in answer.text
    assert "Traceback" not in answer.text and "\n" not in answer.text.strip()


@pytest.mark.parametrize(("method", "path"), [("GET", "/v2"), ("PUT", "/v1/tasks"), ("GET", "/v1/tasks/a/adapt")])
def test_a_path_that_is_not_there_says_where_they_are(http, method, path):
    answer = http.request(method, path)
    assert answer.status_code == 404 and "the page under / lists them" in answer.json()["error"]


def test_tasks_of_another_owner_do_not_exist(http):
    task = http.post("/v1/tasks", json={"document": TASK}).json()["task"]
    other = {"Authorization": f"Bearer {OTHER}"}
    for method, path in (("GET", ""), ("GET", "/turns/0/path.csv"), ("POST", "/undo"), ("DELETE", "")):
        assert http.request(method, f"/v1/tasks/{task}{path}", headers=other).status_code == 404
    assert http.get(f"/v1/tasks/{task}").status_code == 200


def test_the_description_is_whole_and_its_page_loads_nothing(http):
    document = http.get("/openapi.json", headers={"Authorization": ""}).json()
    assert document == json.loads(json.dumps(openapi()))
    named = {entry["operationId"] for path in document["paths"].values() for entry in path.values()}
    assert named == {*OPERATIONS, "read_resource"}
    references = {part.partition('"')[0] for part in json.dumps(document).split("#/components/schemas/")[1:]}
    assert references <= set(document["components"]["schemas"])
    page = http.get("/", headers={"Authorization": ""})
    assert page.text == interface_page() and "default-src 'none'" in page.headers["Content-Security-Policy"]
    assert not any(sign in page.text for sign in ("<script", "http://", "https://", "src="))
    assert all(operation.path in page.text for operation in OPERATIONS.values())


ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/agents.md").read_text(encoding="utf-8")


def test_every_tool_is_in_the_table_with_its_path():
    for operation in OPERATIONS.values():
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| `{operation.name}` |"))
        path = operation.path.replace("/v1/tasks/{task}/", ".../").replace("{task}", "TASK")
        assert row.endswith(f"| `{operation.method} {path}` |")


def test_every_test_that_the_security_list_names_is_there():
    tests = "".join(path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("test_*.py"))
    named = {word for word in PAGE.split("`") if word.startswith("test_")}
    assert len(named) > 15 and all(f"def {name}(" in tests for name in named)


def test_the_talk_on_the_page_is_what_the_example_prints():
    talk = runpy.run_path(str(ROOT / "examples/agent_transcript.py"))["transcript"]()
    assert f"```\n{talk}```" in PAGE
    assert "refused: this client cannot ask a person" in talk and "released: False" in talk
