"""One self-contained HTML page: the tables, the panel, and every sample to look into. No scripts, no links out."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from ovita.bench.records import Record, Round
from ovita.bench.sketch import sketch

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 1160px; margin: 24px auto; padding: 0 16px; color: #1b1b1b; }
table { border-collapse: collapse; margin: 8px 0 20px; font-size: 13px; }
th, td { border-bottom: 1px solid #ddd; padding: 3px 9px; text-align: left; }
th { background: #f4f4f4; } td.n { text-align: right; font-variant-numeric: tabular-nums; }
details { border: 1px solid #ddd; border-radius: 5px; margin: 4px 0; padding: 3px 10px; }
details.group { background: #fafafa; } details details { background: white; }
summary { cursor: pointer; } .ok { color: #00734f; } .no { color: #b33a00; } .faint { color: #666; }
pre { background: #f6f6f6; padding: 8px; overflow-x: auto; font-size: 12px; white-space: pre-wrap; }
.said { white-space: pre-line; }
svg { max-width: 100%; height: auto; } svg text { font: 9px system-ui, sans-serif; fill: #333; }
.panel svg text { font: inherit; } .panel { overflow-x: auto; }
"""

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def html(
    title: str, tables: Sequence[tuple[str, Sequence[Sequence[str]]]], panel: str, records: Sequence[Record]
) -> str:
    """Build the page.

    Args:
        title: Its heading.
        tables: Headings with tables, first row the column names.
        panel: The figures as SVG text, or "".
        records: What to look into.
    """
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{escape(_POLICY)}">',
        f'<meta name="viewport" content="width=device-width"><title>{escape(title)}</title>',
        f"<style>{_STYLE}</style></head><body><h1>{escape(title)}</h1>",
    ]
    parts += [_table(heading, rows) for heading, rows in tables if rows]
    if panel:
        parts.append(f'<h2>Figures</h2><div class="panel">{panel[panel.index("<svg") :]}</div>')
    parts.append("<h2>Samples</h2><p class='faint'>Grey and dashed: before. Blue: after. Squares: objects.</p>")
    groups = dict.fromkeys((r.writer, r.condition, r.subset) for r in records)
    for group in groups:
        parts.append(_group(group, [r for r in records if (r.writer, r.condition, r.subset) == group]))
    parts.append("</body></html>")
    return "\n".join(parts) + "\n"


def _table(heading: str, rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td{_kind(cell)}>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows[1:]
    )
    return f"<h2>{escape(heading)}</h2><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _kind(cell: str) -> str:
    return ' class="n"' if cell[:1].isdigit() or cell[:1] in "-+" else ""


def _group(group: tuple[str, str, str], records: Sequence[Record]) -> str:
    writer, condition, subset = group
    passed = sum(r.last.passed for r in records)
    failed_first = sorted(records, key=lambda r: r.last.passed)
    name = f"{writer}, {condition}, {subset}: {passed} of {len(records)} pass"
    return (
        f'<details class="group"><summary><b>{escape(name)}</b></summary>'
        + "".join(_record(record) for record in failed_first)
        + "</details>"
    )


def _record(record: Record) -> str:
    mark = _mark(record.last.passed)
    void = "".join(f"<p class='faint'>Not judged: {escape(text)}</p>" for text in record.void)
    return (
        f"<details><summary>{mark} <b>{escape(record.sample)}</b> {escape(record.instruction)}"
        f" <span class='faint'>({escape(record.kind)}, robot {escape(record.robot)})</span></summary>{void}"
        + "".join(_round(i, item, record) for i, item in enumerate(record.rounds))
        + f"<details><summary>check</summary><pre>{escape(_check(record.check))}</pre></details></details>"
    )


def _round(number: int, item: Round, record: Record) -> str:
    heading = "answer" if number == 0 else f"feedback {number}: {item.said}"
    plan = "".join(f"<li>{escape(step)}</li>" for step in item.plan)
    facts = (
        f"{item.status}, limits {item.limits}, {item.attempts} attempt(s), {item.ms:.0f} ms,"
        f" {item.input_tokens} + {item.output_tokens} tokens"
    )
    code = f"<details><summary>policy</summary><pre>{escape(item.code)}</pre></details>" if item.code else ""
    return (
        f"<h4>{escape(heading)}</h4><p>{_mark(item.passed)} {escape(item.sentence)}</p>"
        + (f"<p class='no'>{escape(item.error)}</p>" if item.error else "")
        + sketch(record.original, item.adapted, record.scene)
        + (f"<ol>{plan}</ol>" if plan else "")
        + (
            f"<details><summary>explanation</summary><p class='said'>{escape(item.explanation)}</p></details>"
            if item.explanation and item.explanation != item.error
            else ""
        )
        + f"<p class='faint'>{escape(facts)}</p>{code}"
    )


def _mark(passed: bool) -> str:
    return '<span class="ok">pass</span>' if passed else '<span class="no">FAIL</span>'


def _check(check: dict[str, object], depth: int = 0) -> str:
    """A check as indented lines."""
    arguments = check.get("arguments")
    given = ", ".join(f"{k}={v!r}" for k, v in arguments.items()) if isinstance(arguments, dict) else ""
    children = check.get("children")
    lines = [f"{'  ' * depth}{check.get('kind')}({given})"]
    lines += [_check(child, depth + 1) for child in children] if isinstance(children, list) else []
    return "\n".join(lines)
