"""A small study whose participants are simulated: their answers are test data and say nothing about anything."""

import json

from ovita.bench.records import Record, RecordLog, Round

ROWS = ((0.0, 0.0, 0.1, 0.2), (0.1, 0.0, 0.1, 0.2), (0.2, 0.0, 0.1, 0.2))
CONSENT = (
    "Test data: a program answers this. What is stored, for how long, whom to ask, and how to stop is said here.\n"
)
NAMES = ("alpha:secret-model", "baseline:copy", "baseline:random")


def record(sample, writer, *, instruction="go up", explanation="It went up.", adapted=ROWS, status="done"):
    shifted = tuple((x, y, z + 0.1 * len(writer) / 10, v) for x, y, z, v in adapted)
    model = writer.partition(":")[2]
    done = Round(
        said=instruction, status=status, passed=True, score=1.0, sentence="", executable=status == "done", attempts=1,
        ms=123.456, model=model, plan=("Shift the path up.",), explanation=explanation, adapted=shifted,
    )  # fmt: skip
    scene = {"objects": [{"name": "cup", "x": 0.1, "y": 0.2, "z": 0.05}], "constraints": ""}
    return Record(
        sample=sample, subset="tests", kind="cartesian", writer=writer, condition="default", instruction=instruction,
        robot="none", idle=False, original=ROWS, scene=scene, check={}, rounds=(done,),
    )  # fmt: skip


def write_run(folder, samples=6, writers=NAMES, **more):
    with RecordLog(folder) as log:
        for i in range(samples):
            for writer in writers:
                log.append(record(f"tests/item_{i}", writer, **more))
    return str(folder)


def write_design(folder, **changes):
    wanted = {
        "title": "Test data", "consent": "consent.txt", "participants": 6, "per_person": 6, "seed": 3, "attention": 1,
        "pilot": True,
    } | changes  # fmt: skip
    tables = {key: wanted.pop(key) for key in list(wanted) if isinstance(wanted[key], dict)}
    lines = [f"{key} = {json.dumps(value)}" for key, value in wanted.items()]
    for name, table in tables.items():
        lines += [f"[{name}]", *(f"{json.dumps(key)} = {json.dumps(value)}" for key, value in table.items())]
    folder.mkdir(exist_ok=True)
    (folder / "STUDY.toml").write_text("\n".join(lines), encoding="utf-8")
    (folder / "consent.txt").write_text(CONSENT, encoding="utf-8")
    return str(folder / "STUDY.toml")
