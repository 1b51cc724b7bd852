"""The page: viser's client, with the studio's name and look put into its head."""

from __future__ import annotations

from functools import cache
from pathlib import Path

BRAND = (39, 84, 125)
"""Colour of buttons and sliders (RGB)."""

_HEAD = """<title>ovita studio</title>
<link rel="icon" href="data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 32 32'%3E%3Crect
 width='32' height='32' rx='7' fill='%2327547d'/%3E%3Cpath d='M5 23C11 23 11 9 17 9s5 9 10 9' fill='none'
 stroke='%23fff' stroke-width='3' stroke-linecap='round'/%3E%3Ccircle cx='27' cy='18' r='2.6'
 fill='%23ff8d7a'/%3E%3C/svg%3E">
<style>
:root { --ink: #22303c; --soft: #5b6b7a; --line: #dde4ea; --card: #f5f8fa; --brand: #27547d;
  --blue: #1f5fbf; --red: #d62728; --good: #1e7f4f; --warn: #b26a00; --bad: #b3261e; }
.ov { color: var(--ink); font-size: 0.86rem; line-height: 1.42; padding: 0 0.65rem 0.45rem; overflow-wrap: anywhere; }
.ov p { margin: 0.15rem 0 0.4rem; } .ov ul, .ov ol { margin: 0.1rem 0 0.4rem; padding-left: 1.15rem; }
.ov li { margin: 0.14rem 0; } .ov h4 { margin: 0.55rem 0 0.2rem; font-size: 0.8rem; color: var(--soft);
  font-weight: 600; letter-spacing: 0.02em; }
.ov .brand { display: flex; align-items: baseline; gap: 0.45rem; font-size: 1.02rem; font-weight: 650;
  padding-top: 0.15rem; } .ov .brand small { font-weight: 400; color: var(--soft); font-size: 0.78rem; }
.ov .card { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 0.45rem 0.6rem;
  margin: 0.1rem 0 0.3rem; } .ov .soft { color: var(--soft); font-size: 0.8rem; }
.ov .chip { display: inline-block; border-radius: 9px; padding: 0 0.5em; font-size: 0.72rem; font-weight: 600;
  line-height: 1.5; background: #e6edf3; color: var(--soft); vertical-align: 0.05em; }
.ov .chip.good { background: #ddf1e6; color: var(--good); } .ov .chip.warn { background: #fdeccd; color: var(--warn); }
.ov .chip.bad { background: #fbe1df; color: var(--bad); } .ov .bad { color: var(--bad); }
.ov .key { display: inline-block; width: 1.2em; height: 0.28em; border-radius: 2px; margin: 0 0.3em 0.2em 0; }
.ov .turn { display: flex; gap: 0.5rem; padding: 0.28rem 0; border-top: 1px solid var(--line); }
.ov .turn:first-child { border-top: 0; } .ov .turn > b { color: var(--soft); font-weight: 600; min-width: 1.1em; }
.ov .turn.now { background: #eaf2f9; margin: 0 -0.6rem; padding-left: 0.6rem; padding-right: 0.6rem; }
.ov .turn.gone { opacity: 0.5; } .ov svg { width: 100%; height: auto; display: block; }
.ov pre { margin: 0.2rem 0; font: 0.74rem/1.45 ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace;
  background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 0.5rem;
  white-space: pre-wrap; }
.ov pre i { font-style: normal; color: #9aa7b3; user-select: none; } .ov pre mark { background: #fbd5d1; }
.ov table { border-collapse: collapse; width: 100%; font-size: 0.8rem; }
.ov td, .ov th { text-align: left; padding: 0.15rem 0.3rem 0.15rem 0; vertical-align: top; border-top: 1px solid
  var(--line); } .ov th { color: var(--soft); font-weight: 600; border-top: 0; }
.ov .ramp { height: 0.6rem; border-radius: 4px; margin: 0.2rem 0; }
div:has(> p > label:empty) { display: none; }
p:has(> label) { letter-spacing: -0.1px !important; }
form input { min-height: 2.1rem !important; height: 2.1rem !important; font-size: 0.86rem !important; }
div:has(> .secret) + * input { -webkit-text-security: disc; }
textarea { font-family: ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace !important;
  font-size: 0.76rem !important; }
</style>
"""


@cache
def page() -> bytes:
    """The page that every browser gets first."""
    import viser

    plain = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
    start, end = plain.index("<head>") + len("<head>"), plain.index("</head>")
    head = plain[start:end]
    for tag, close in (("<title>", "</title>"), ("<link", "/>")):
        if tag in head:
            first = head.index(tag)
            head = head[:first] + head[head.index(close, first) + len(close) :]
    return (plain[:start] + head + _HEAD + plain[end:]).encode()
