"""For agents and other programs: the tools of ovita over MCP and REST, behind an operator's rules (extra `serve`).

`application` does what is asked and knows no transport; `operations` lists what there is; `protocol` speaks MCP, and
`web` speaks HTTP. What comes in is judged by `access` first, and what is done goes to the audit log.
"""
