"""MAVSDK as a judge, run by the Python of a virtual environment that has it; prints JSON lines.

mavsdk_judge.py vehicle PORT    an autopilot that takes a mission from a station listening at PORT, and prints it
mavsdk_judge.py plan FILE       what MAVSDK reads in a QGroundControl plan (it needs a system, so it makes one)
mavsdk_judge.py copter PORT     a multicopter that is where it is told to be, and prints what it was told when it holds
"""

import json
import sys
import threading
import time

from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration, Mavsdk
from mavsdk.plugins.mavlink_direct_server import MavlinkDirectServer, MavlinkMessage
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


def copter(url):
    """PX4's modes over MAVSDK's own reading and writing of MAVLink (libmav)."""
    sdk = Mavsdk(Configuration.create_manual(1, 191, False))  # whose own heartbeats come from elsewhere
    server = MavlinkDirectServer(sdk.server_component_by_id(1))
    sdk.add_any_connection(url)
    hold, state = 4 << 16 | 3 << 24, {"mode": 4 << 16 | 3 << 24, "armed": 0, "place": [0.0, 0.0, -1.0]}
    told, modes = [], []

    def say(name, **fields):
        server.send_message(MavlinkMessage(name, 1, 1, 255, 190, json.dumps(fields)))

    def command(message, _):
        asked = json.loads(message.fields_json)
        if asked["command"] == 176:
            state["mode"] = int(asked["param2"]) << 16 | int(asked["param3"]) << 24
            modes.append(state["mode"])
        elif asked["command"] == 400:
            state["armed"] = 128 * int(asked["param1"])
        say("COMMAND_ACK", command=asked["command"], result=0, target_system=255, target_component=190)

    def setpoint(message, _):
        asked = json.loads(message.fields_json)
        told.append([asked[key] for key in ("x", "y", "z", "vx", "vy", "vz", "type_mask", "coordinate_frame")])
        if state["armed"] and state["mode"] != hold:
            state["place"] = told[-1][:3]

    server.subscribe_message("COMMAND_LONG", command)
    server.subscribe_message("SET_POSITION_TARGET_LOCAL_NED", setpoint)
    end, beat = time.monotonic() + 30, 0
    while time.monotonic() < end and not (modes and modes[-1] == hold):
        if beat % 4 == 0:
            mode = {"base_mode": 1 | state["armed"], "custom_mode": state["mode"]}
            say("HEARTBEAT", type=2, autopilot=12, **mode, system_status=4, mavlink_version=3)
        x, y, z = state["place"]
        say("LOCAL_POSITION_NED", time_boot_ms=beat * 50, x=x, y=y, z=z, vx=0.0, vy=0.0, vz=0.0)
        beat += 1
        time.sleep(0.05)
    for _ in range(20):  # until the station has seen it hold
        say("HEARTBEAT", type=2, autopilot=12, base_mode=129, custom_mode=hold, system_status=4, mavlink_version=3)
        time.sleep(0.05)
    print(json.dumps({"told": told, "modes": modes, "place": state["place"]}), flush=True)


def main():
    what, argument = sys.argv[1:3]
    if what == "copter":
        copter(f"udpout://127.0.0.1:{argument}")
        return
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
