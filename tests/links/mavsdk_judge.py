"""MAVSDK as a judge, run by the Python of a virtual environment that has it; prints JSON lines.

mavsdk_judge.py vehicle PORT    an autopilot that takes a mission from a station listening at PORT, and prints it
mavsdk_judge.py plan FILE       what MAVSDK reads in a QGroundControl plan (it needs a system, so it makes one)
"""

import json
import sys
import threading
import time

from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration, Mavsdk
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.mission_raw_server import MissionRawServer

FIELDS = ("seq", "frame", "command", "current", "autocontinue", *(f"param{i}" for i in range(1, 5)), "x", "y", "z")


def rows(items):
    return [{field: getattr(item, field) for field in FIELDS} for item in items]


def autopilot(url):
    sdk = Mavsdk(Configuration.create_with_component_type(ComponentType.AUTOPILOT))
    server = MissionRawServer(sdk.server_component(0))
    done = threading.Event()

    def take(result, plan, _):
        print(json.dumps(rows(plan.mission_items)), flush=True)
        done.set()

    server.subscribe_incoming_mission(take)
    sdk.add_any_connection(url)
    return sdk, server, done


def main():
    what, argument = sys.argv[1:3]
    if what == "vehicle":
        kept = autopilot(f"udpout://127.0.0.1:{argument}")
        kept[2].wait(20)
        time.sleep(3)  # it is read back
        return
    kept = autopilot("udpin://127.0.0.1:24999")
    sdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    sdk.add_any_connection("udpout://127.0.0.1:24999")
    system = sdk.first_autopilot(10)
    data = MissionRaw(system).import_qgroundcontrol_mission(argument)
    print(json.dumps(rows(data.mission_items)), flush=True)
    del kept


main()
