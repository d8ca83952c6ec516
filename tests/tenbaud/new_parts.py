"""One new part of each sort, as its author would write it: a module, and the line that registers it."""

from __future__ import annotations

from typing import NamedTuple


class NewPart(NamedTuple):
    """A part that the project does not have yet."""

    module: str
    """dotted name of its module"""
    attribute: str
    registry: str
    """file that the line goes into"""
    line_above: str
    """the first line of its table"""
    group: str
    """of entry points"""
    source: str


LAW = '''
class Pull:
    """Pulls the body to the set-point like a spring with a damper."""

    def __init__(self, context, stiffness: float = 3.0):
        self.context, self.stiffness = context, stiffness

    def command(self, tick, state):
        volts = self.stiffness * (self.references(tick)[0] - state[0]) - 3.0 * state[1]
        return volts / 2.0, -volts / 2.0

    def references(self, tick):
        return (self.context.reference.value(tick),)
'''

PLANT = '''
class Cart:
    """A double integrator with friction."""

    def __init__(self, context, friction: float = 0.5):
        self.step_s, self.friction = context.step_s, friction
        self.place, self.speed = (*context.initial, 0.0)[0], 0.0

    @property
    def measured(self):
        return (self.place,)

    def advance(self, volts):
        push = 0.4 * (volts[0] - volts[1]) - self.friction * self.speed
        self.speed += self.step_s * push
        self.place += self.step_s * self.speed
'''

MODEL = '''
class CartModel:
    """What both codecs predict the cart with."""

    state_size, correction_size, input_size = 2, 2, 2

    def __init__(self, context, friction: float = 0.5):
        self.tick_s, self.friction = context.tick_s, friction

    def initial(self):
        return (0.0, 0.0)

    def measured(self, state):
        return state[:1]

    def tick(self, state, command, held):
        push = 0.4 * (command[0] - command[1]) - self.friction * state[1] + held[1]
        speed = state[1] + self.tick_s * push
        return (state[0] + self.tick_s * (speed + held[0]), speed)
'''

CODER = '''
from channel.codec.codec import ERASED, Alphabet


class Steps:
    """A fixed step up or down."""

    impulse = True

    def __init__(self, context, step_rad: float = 0.02):
        self.step_rad, self.alphabet = step_rad, Alphabet((-1, 1), 1)

    def initial(self):
        return (self.step_rad,)

    def encode(self, coder, predicted, measurement):
        return (1 if measurement[0] >= predicted[0] else -1,)

    def decode(self, coder, state, word):
        step = 0.0 if word is ERASED else self.step_rad * word[0]
        return (step, 2.0 * step), coder

    def ranges(self, coder):
        return coder
'''

LINK = '''
import socket
from contextlib import contextmanager

from channel.links.base import Link
from channel.links.kind import LinkKind, Meeting


class Datagrams(Link):
    """One end: a UDP socket on the loopback interface."""

    name = "datagrams"

    def __init__(self, own_port, peer_port):
        super().__init__()
        self.peer = ("127.0.0.1", peer_port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", own_port))

    def send(self, data):
        self.socket.sendto(data, self.peer)
        self.counts.messages_out += 1
        self.counts.bytes_out += len(data)

    def receive(self, timeout_s):
        self.socket.settimeout(timeout_s)
        try:
            data = self.socket.recv(65536)
        except (BlockingIOError, TimeoutError):
            return None
        self.counts.messages_in += 1
        self.counts.bytes_in += len(data)
        return data

    def peer_present(self):
        return True

    def close(self):
        self.socket.close()


class DatagramKind(LinkKind):
    """Two processes of one machine, by UDP."""

    def open(self, end):
        return Datagrams(end.settings.options["own_port"], end.settings.options["peer_port"])

    @contextmanager
    def meeting(self, settings):
        here = ("127.0.0.1", 0)
        with socket.create_server(here) as one, socket.create_server(here) as two:
            near, far = one.getsockname()[1], two.getsockname()[1]
            yield (
                Meeting({"options": {"own_port": near, "peer_port": far}}),
                Meeting({"options": {"own_port": far, "peer_port": near}}),
            )
'''

KINDS = "tenbaud/config/kinds.py"
LINKS = "channel/links/registry.py"
NEW_PARTS = {
    "cart_model": NewPart(
        "channel.codec.models.cart", "CartModel", KINDS, '"pitch": "tenbaud.config.models:PITCH"',
        "tenbaud.models", MODEL,
    ),
    "steps": NewPart(
        "channel.codec.coders.steps", "Steps", KINDS, '"zoom": "tenbaud.config.coders:ZOOM"',
        "tenbaud.coders", CODER,
    ),
    "cart": NewPart(
        "plant_sim.cart", "Cart", KINDS, '"pitch": "tenbaud.build.rig:pitch_plant"',
        "tenbaud.plants", PLANT,
    ),
    "pull": NewPart(
        "receiver.controllers.pull", "Pull", KINDS, '"pid": "tenbaud.build.controllers:pid"',
        "tenbaud.controllers", LAW,
    ),
    "datagrams": NewPart(
        "channel.links.datagrams", "DatagramKind", LINKS,
        '"zenoh": "channel.links.zenoh.kind:ZenohKind"', "tenbaud.links", LINK,
    ),
}  # fmt: skip
CHOSEN = {
    "model.kind": "cart_model",
    "coder.kind": "steps",
    "transmitter.plant.kind": "cart",
    "receiver.controller": "pull",
    "link.kind": "datagrams",
}
"""The settings that fly them all at once."""
