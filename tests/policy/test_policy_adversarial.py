"""Hostile policies do no harm, with the allowlist check and, since the kernel must hold alone, without it."""

import sys

import pytest
from adversarial.theatre import Theatre, policies

from ovita.errors import PolicyRejected, RequestError
from ovita.policy.check import check

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="strict isolation needs Linux")

POLICIES = policies()
STOPPED_WHILE_RUNNING = {
    "escapes/annotation",  # annotations are never evaluated
    "escapes/enum_by_call",
    "escapes/enum_by_call_in_module",
    "escapes/enum_create_by_name",
    "escapes/enum_global",
    "escapes/enum_interface",
    "escapes/enum_metaclass",
    "escapes/getattr_joined",
    "escapes/getattr_map",
    "escapes/getattr_str_subclass",
    "escapes/global_open",
    "escapes/module_leak_json",
    "escapes/namedtuple_eval",
    "escapes/setattr_joined",
    "escapes/shadow_open",
    "numpy_doors/array_interface_setattr",
}
"""What the check cannot see in the source, so that reduced modules and builtins must stop it."""


@pytest.fixture(scope="module")
def theatre():
    theatre = Theatre()
    yield theatre
    theatre.close()


@pytest.mark.parametrize("checked", [True, False], ids=["checked", "kernel-alone"])
@pytest.mark.parametrize("name", POLICIES)
def test_no_escape(name, checked, theatre):
    outcome, seen = theatre.play(POLICIES[name], checked=checked)
    ran = not isinstance(outcome, PolicyRejected)
    assert [*seen, *(theatre.aftermath() if ran else [])] == [], outcome


@pytest.mark.parametrize("name", [n for n in POLICIES if not n.startswith("bombs/")])
def test_the_allowlist_holds_alone_against_what_needs_no_brute_force(name, theatre):
    source = theatre.stage(POLICIES[name])
    if name not in STOPPED_WHILE_RUNNING:
        with pytest.raises(PolicyRejected):
            check(source)
        return
    check(source)
    outcome, seen = theatre.play(POLICIES[name], checked=True, isolation="degraded", locked=False)
    assert seen == [], outcome


def test_the_check_cannot_be_left_out_where_the_kernel_does_not_hold(theatre):
    outcome, seen = theatre.play(POLICIES["files/open_write"], checked=False, isolation="degraded")
    assert isinstance(outcome, RequestError)
    assert seen == []


def test_there_are_enough():
    assert len(POLICIES) >= 400
