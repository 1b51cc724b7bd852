"""A program that stands in for a baseline: lifts the path, or misbehaves as its first argument says."""

import json
import os
import sys
import time

mode = sys.argv[1]
for line in sys.stdin:
    asked = json.loads(line)
    if mode == "crash":
        print("loading\nOSError: no weights in model/latte.h5", file=sys.stderr)
        sys.exit(3)
    if mode == "hang":
        time.sleep(600)
    if mode == "chatter":
        print("DONE - computing textual embeddings (1, 768)", flush=True)
        continue
    rows = [[x, y, z + 0.1, speed] for x, y, z, speed in asked["trajectory"]]
    names = [item["name"] for item in asked["objects"]]
    answer = {"trajectory": rows, "matched": f"{asked['instruction']}|{asked['frame']}|{names}", "similarity": 0.5}
    answer |= {
        "process": {"matched": str(os.getpid())},
        "error": {"error": "more than 6 objects"},
        "rows": {"trajectory": [[1, 2]]},
        "word": {"similarity": "high"},
    }.get(mode, {})
    print(json.dumps([answer] if mode == "list" else answer), flush=True)
    if mode == "once":
        sys.exit(0)
