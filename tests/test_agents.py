"""Agents: each drives one robot with what its neighbours tell, and together they are one controller."""

from __future__ import annotations

import pickle
import re
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from cells import smooth_motion
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from refusals import refused

from synctrl import (
    Agent,
    CartesianSpace,
    Cell,
    Coupling,
    DiscreteController,
    Experiment,
    Gains,
    Hold,
    Member,
    Message,
    Network,
    Redundancy,
    load_robot,
)
from synctrl.control.adaptation import Ball, Box, Composite, Gradient, Leakage, Natural
from synctrl.control.laws import ChungSlotine, MasterSlave, ShapeKeeping, SlotineLi, SunMills
from synctrl.errors import InputError, ResultError
from synctrl.experiments import a460_pair, mixed_four, planar_four

PERIOD = 2e-3

NETWORKS = {
    "hold": Network(4e-3, receiver="hold"),
    "filter": Network(4e-3),
    "extrapolate": Network(4e-3, receiver="extrapolate"),
    "hold, late": Network(4e-3, delay=5e-3, receiver="hold"),
    "filter, late": Network(3e-3, delay=[[0, 7e-3, 1e-3, 2e-3]] * 4),
    "extrapolate, late": Network(2e-3, delay=3e-3, receiver="extrapolate"),
    "more often than samples": Network(1e-3, delay=2e-3),
    "out of order": Network(2e-3, delay=1e-3, jitter=9e-3, seed=1),
    "lossy": Network(2e-3, jitter=3e-3, loss=0.4, receiver="hold", seed=2),
    "in bursts": Network(2e-3, burst=(0.3, 0.3), seed=3),
    "events": Network(2e-3, delay=3e-3, event=2e-3, heartbeat=0.02),
}


class Air:
    """What carries messages as a network between all robots does, with the same chances."""

    def __init__(self, whole: DiscreteController):
        self._network, self._period = whole.controller.network, whole.period
        self._bad = SimpleNamespace(bad=np.zeros(self._network.links.count))
        self._under_way: list[tuple[float, int, Message]] = []

    def carry(self, sample: int, sent: Iterable[Message]) -> dict[int, list[Message]]:
        """What robots hear with a sample, of what they sent with it and before."""
        end = (sample + 1e-9) * self._period
        for k in (round(t / self._network.traffic.period) for t in self._grid(sample)):
            self._post(k, {m.sender: m for m in sent if round(m.stamp / self._network.traffic.period) == k})
        heard: dict[int, list[Message]] = {}
        for arrival, hearer, message in self._under_way:
            if arrival < end:
                heard.setdefault(hearer, []).append(message)
        self._under_way = [entry for entry in self._under_way if not entry[0] < end]
        return heard

    def _grid(self, sample: int) -> np.ndarray:
        start, end = ((s + 1e-9) * self._period if s >= 0 else 0.0 for s in (sample - 1, sample))
        period = self._network.traffic.period
        times = period * np.arange(round(end / period) + 2)
        return times[(times >= start) & (times < end)]

    def _post(self, k: int, sent: dict[int, Message]) -> None:
        links = self._network.links
        lost = self._network._lost(k, self._bad) if k else np.zeros(links.count, dtype=bool)
        arrival = self._network._arrival(k) if k else np.zeros(links.count)
        for link, (hearer, sender) in enumerate(zip(links.hearer, links.sender, strict=True)):
            if sender in sent and not lost[link]:
                self._under_way.append((arrival[link], int(hearer), sent[sender]))


#: a time, and positions and velocities then
Sample = tuple[float, np.ndarray, np.ndarray]


def measured(cell: Cell, samples: int, seed: int = 0) -> list[Sample]:
    """Times, positions and velocities of robots that wobble about where they start."""
    rng = np.random.default_rng(seed)
    mine = np.array([np.arange(cell.nv) < robot.nv for robot in cell.robots])
    a, b = 0.02 * rng.standard_normal((2, cell.n, cell.nv)) * mine
    times = PERIOD * np.arange(samples)
    return [(float(t), cell.q0 + a * np.sin(9 * t), cell.v0 + 9 * a * np.cos(9 * t) + b) for t in times]


def carried(
    whole: DiscreteController, agents: Sequence[Agent], samples: Iterable[Sample]
) -> list[np.ndarray]:
    """Torques of agents, (n, nv) at each sample, that hear what a network between them brings."""
    air, joints = Air(whole), [robot.nv for robot in whole.cell.robots]
    torques = []
    for k, (t, q, v) in enumerate(samples):
        own = [(agents[i], (t, q[i, :nv], v[i, :nv])) for i, nv in enumerate(joints)]
        sent = [message for agent, seen in own for message in agent.tell(*seen)]
        heard, tau = air.carry(k, sent), np.zeros(q.shape)
        for agent, seen in own:
            tau[agent.robot, : joints[agent.robot]] = agent.step(*seen, heard.get(agent.robot, ()))
        torques.append(tau)
    return torques


def small_pair(**changes: object) -> Experiment:
    """Two planar arms in joint space."""
    arm, rng = load_robot("planar2r"), np.random.default_rng(5)
    members = [
        Member(arm.placed((x, 0, 0)), smooth_motion(rng, 2, 0.3, np.array([0.3, 1.0])), q0=[0.3, 1.0])
        for x in (0.0, 1.5)
    ]
    parts = {"network": Network(4e-3, delay=3e-3), "gains": Gains(10.0, 5.0, 4.0, 2.0, 0.5), **changes}
    return Experiment(Cell(members, Coupling.pair()), parts.pop("gains"), 0.1, **parts)


def both(experiment: Experiment, samples: int = 12) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Torques of one controller, and of agents, for the same measurements."""
    whole, seen = experiment.controller(PERIOD), measured(experiment.cell, samples)
    return [whole.step(*one) for one in seen], carried(whole, experiment.agents(PERIOD), seen)


# -- one controller, or many agents -----------------------------------------------------------------------


@pytest.mark.parametrize("name", NETWORKS)
def test_agents_give_the_run_of_one_controller_bit_for_bit(name: str) -> None:
    experiment = replace(planar_four(), network=NETWORKS[name])
    run = experiment.simulate(0.1, dt=PERIOD, control_period=PERIOD, engine="pinocchio")
    whole, agents = experiment.controller(PERIOD), experiment.agents(PERIOD)
    torques = carried(whole, agents, zip(run.t.tolist(), run.q, run.v, strict=True))
    np.testing.assert_array_equal(torques, run.tau)


@pytest.mark.parametrize("name", ["filter, late", "lossy", "events"])
def test_agents_remember_what_one_controller_remembers_of_each(name: str) -> None:
    experiment = replace(planar_four(), network=NETWORKS[name])
    whole, agents = experiment.controller(PERIOD), experiment.agents(PERIOD)
    seen = measured(experiment.cell, 30)
    carried(whole, agents, seen)
    for one in seen:
        whole.step(*one)
    for i, agent in enumerate(agents):
        network = agent._network
        expected = network.share(whole.memory, whole.controller.network)
        found = agent.state["network_state"]
        np.testing.assert_array_equal(found, expected)
        np.testing.assert_array_equal(agent.state["z"][0], whole.z[i])


def wide() -> Experiment:
    """Two arms with joints to spare, postures and gains of their own, and a weight that moves."""
    arm, rng = load_robot("ur5"), np.random.default_rng(2)
    q0 = np.array([[0.1, -1.2, 1.3, -0.3, 0.4, 0.2], [0.3, -1.0, 1.1, -0.2, 0.5, 0.1]])
    members = [
        Member(arm.placed((2.0 * i, 0, 0)), Hold(arm.placed((2.0 * i, 0, 0)).tip_position(q)), q0=q)
        for i, q in enumerate(q0)
    ]
    sway = Coupling.pair(lambda t: ([1 + t, t - 2], [1, 1], [0, 0]))
    cell = Cell(members, sway, CartesianSpace("xyz", redundancy=Redundancy(posture=list(q0 + 0.2))))
    gains = Gains(5.0, 2.0, rng.uniform(5, 9, (2, 6)), 3.0, rng.uniform(0, 0.1, (2, 60)))
    return Experiment(cell, gains, 0.1, network=Network(4e-3, delay=2e-3))


def learning(adaptation: object) -> Experiment:
    return small_pair(gains=Gains(10.0, 5.0, 4.0, 2.0), adaptation=adaptation)


def independent(law: object) -> Experiment:
    return small_pair(gains=Gains(10.0, 0.0, 4.0, 0.0, 0.5), law=law)


rows = np.random.default_rng(7).uniform(0.1, 0.5, (2, 20))
WHOLES: dict[str, Callable[[], Experiment]] = {
    "a rate for each robot": lambda: learning(Gradient(rows)),
    "a matrix for each robot": lambda: learning(Gradient([np.diag(row) + 0.01 for row in rows])),
    "estimates that leak": lambda: learning(Leakage(rows, 0.1)),
    "a box for each robot": lambda: learning(Box(rows, -rows, rows)),
    "a ball for each robot": lambda: learning(Ball(0.5, [0.1, 0.2])),
    "composite": lambda: learning(Composite(0.3, 1.0, 20.0, memory=1.0)),
    "natural": lambda: replace(a460_pair(adaptation=Natural(0.1)), network=Network(4e-3, receiver="hold")),
    "limits that are known": lambda: small_pair(saturate=True),
    "integrals that leak": lambda: small_pair(gains=Gains(10.0, 5.0, 4.0, 2.0, 0.5, leak=1.0)),
    "damping in task space": lambda: small_pair(k_r_space="task"),
    "damping of what delays may take": lambda: small_pair(law=SunMills(injection=True)),
    "xref'' as printed": lambda: small_pair(reference_acceleration="paper"),
    "Chung and Slotine": lambda: independent(ChungSlotine(0.5)),
    "Slotine and Li": lambda: independent(SlotineLi()),
    "postures, and weights that move": wide,
    "clocks that differ": lambda: small_pair(network=Network(4e-3, offset=[0.0, 0.02])),
    "clocks that differ, and weights that move": lambda: replace(
        wide(), network=Network(4e-3, offset=[0.01, 0.0])
    ),
}


@pytest.mark.parametrize("name", WHOLES)
def test_parts_that_work_robot_by_robot_work_in_agents(name: str) -> None:
    together, apart = both(WHOLES[name]())
    np.testing.assert_array_equal(apart, together)


def test_robots_of_different_sizes_differ_by_rounding_at_most() -> None:
    together, apart = both(replace(mixed_four(), network=Network(4e-3)), 4)
    np.testing.assert_allclose(apart, together, rtol=1e-9, atol=1e-9 * np.abs(together).max())


def test_two_processes_that_share_a_pipe_do_what_one_does_bit_for_bit() -> None:
    script = Path(__file__).parent.parent / "scripts" / "agents_over_a_pipe.py"
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    torque, difference = re.findall(r"([\d.e-]+) N", done.stdout)
    assert float(torque) > 1.0
    assert float(difference) == 0.0


# -- what an agent knows ----------------------------------------------------------------------------------


class Kept:
    """A desired motion that does not leave its process, and says nothing once it is poisoned."""

    breaks = ()
    dimension = 2
    poisoned = False

    def __call__(self, t):
        x = np.full((*np.shape(t), 2), np.nan if self.poisoned else 0.3)
        return x, 0 * x, 0 * x

    def __reduce__(self):
        raise AssertionError("somebody took it along")


def guarded_pair(kept: Kept) -> Experiment:
    """A pair of arms, of which the second is nobody else's business."""
    arm = load_robot("planar2r")
    members = [
        Member(arm, Hold([0.3, 1.0]), q0=[0.2, 1.1]),
        Member(arm.placed((1.5, 0, 0)), kept, q0=[0.31, 0.3], theta_hat0=np.full(20, 0.123), name="secret"),
    ]
    return Experiment(
        Cell(members, Coupling.pair()), Gains(10.0, 5.0, 4.0, 2.0, 0.5), 0.1, network=Network(PERIOD)
    )


def test_an_agent_goes_elsewhere_without_the_others_and_does_the_same_there() -> None:
    kept = Kept()
    experiment = guarded_pair(kept)
    first, second = experiment.agents(PERIOD)
    seen = measured(experiment.cell, 10)
    told = [second.tell(t, q[1], v[1]) for t, q, v in seen[:1]]
    told += [(Message(1, t, 0.01 * np.sin([[t, 2 * t]])),) for t, _, _ in seen[1:]]
    luggage = pickle.dumps(first)
    assert b"secret" not in luggage
    assert struct.pack("<d", 0.123) not in luggage
    expected = [first.step(t, q[0], v[0], inbox) for (t, q, v), inbox in zip(seen, told, strict=True)]
    kept.poisoned = True
    for rows in (experiment.cell.q0, experiment.cell.v0, experiment.cell.theta_hat0, experiment.cell.theta):
        rows[...] = np.nan
    del experiment, second
    elsewhere = pickle.loads(luggage)
    found = [elsewhere.step(t, q[0], v[0], inbox) for (t, q, v), inbox in zip(seen, told, strict=True)]
    np.testing.assert_array_equal(found, expected)


def test_what_an_agent_keeps_grows_with_its_neighbours_and_not_with_the_robots() -> None:
    def ring(n: int) -> Agent:
        arm = load_robot("planar2r")
        members = [Member(arm.placed((2.0 * i, 0, 0)), Hold([0.3, 1.0]), q0=[0.3, 1.0]) for i in range(n)]
        cell = Cell(members, Coupling.signed_ring(n))
        return Experiment(cell, Gains(10.0, 5.0, 4.0, 2.0, 0.5), 0.1, network=Network(4e-3)).agents(PERIOD)[0]

    few, many = ring(4), ring(12)
    assert few.hears == (1, 3)
    assert many.hears == (1, 11)
    assert {k: a.shape for k, a in few.state.items()} == {k: a.shape for k, a in many.state.items()}
    assert len(pickle.dumps(many)) < len(pickle.dumps(few)) + 64


# -- messages ---------------------------------------------------------------------------------------------

sane = st.floats(-1e12, 1e12)
shapes = st.tuples(st.integers(1, 3), st.integers(1, 4))
told = shapes.flatmap(lambda shape: arrays(float, shape, elements=sane))
messages = st.builds(Message, st.integers(0, 2**32 - 1), sane, told)


@given(messages)
def test_a_message_comes_back_from_its_bytes(message: Message) -> None:
    data = message.to_bytes()
    again = Message.from_bytes(data)
    assert (again.sender, again.stamp) == (message.sender, message.stamp)
    np.testing.assert_array_equal(again.rows, message.rows)
    assert again.to_bytes() == data
    assert len(data) == 24 + 8 * message.rows.size


def test_the_layout_of_a_message_is_the_one_that_is_written_down() -> None:
    rows = [[1.0, -2.0], [3.0, 0.5]]
    body = struct.pack("<4sBBHId4d", b"sync", 1, 2, 2, 7, 0.25, 1.0, -2.0, 3.0, 0.5)
    assert Message(7, 0.25, np.array(rows)).to_bytes()[:-4] == body


@given(messages, st.data())
def test_bytes_that_were_harmed_are_refused(message: Message, data: st.DataObject) -> None:
    whole = bytearray(message.to_bytes())
    place = data.draw(st.integers(0, len(whole) - 1))
    whole[place] ^= 1 << data.draw(st.integers(0, 7))
    with refused(InputError, "message"):
        Message.from_bytes(bytes(whole))
    with refused(InputError, "message"):
        Message.from_bytes(message.to_bytes()[:place])


@pytest.mark.parametrize(
    ("subject", "message"),
    [
        ("message, rows", lambda: Message(0, 0.0, np.array([[np.nan]]))),
        ("message, rows", lambda: Message(0, 0.0, np.zeros((4, 2)))),
        ("message, stamp", lambda: Message(0, np.inf, np.zeros((1, 2)))),
        ("message, sender", lambda: Message(-1, 0.0, np.zeros((1, 2)))),
        ("message, sender", lambda: Message(2**32, 0.0, np.zeros((1, 2)))),
        ("message", lambda: Message.from_bytes("sync")),
    ],
)
def test_numbers_that_mean_nothing_are_no_message(subject: str, message: Callable[[], Message]) -> None:
    with refused(InputError, subject):
        message()


def test_a_message_with_numbers_that_are_not_finite_is_refused_on_reading() -> None:
    body = struct.pack("<4sBBHId2d", b"sync", 1, 1, 2, 0, 0.0, np.nan, 1.0)
    with refused(InputError, "message, rows"):
        Message.from_bytes(body + struct.pack("<I", zlib.crc32(body)))


# -- on a robot -------------------------------------------------------------------------------------------


def one(**changes: object) -> tuple[Agent, list[Sample]]:
    """The first of two agents, and what it measures."""
    experiment = small_pair(**changes)
    seen = [(t, q[0], v[0]) for t, q, v in measured(experiment.cell, 8)]
    return experiment.agents(PERIOD)[0], seen


def heard(k: int, rows: int = 3) -> Message:
    return Message(1, 4e-3 * k, 0.01 * np.random.default_rng(k).standard_normal((rows, 2)))


@pytest.mark.parametrize("receiver", ["hold", "filter"])
def test_order_and_repetition_of_messages_do_not_matter(receiver: str) -> None:
    (plain, seen), (shuffled, _) = (one(network=Network(4e-3, receiver=receiver)) for _ in range(2))
    for agent, inbox in ((plain, [heard(0)]), (shuffled, [heard(0), heard(0)])):
        agent.step(*seen[0], inbox)
    old, new = heard(1), heard(2)
    for agent in (plain, shuffled):
        agent.step(*seen[1])
    expected = plain.step(*seen[2], [old, new])
    np.testing.assert_array_equal(shuffled.step(*seen[2], [new, old, new]), expected)
    np.testing.assert_array_equal(shuffled.step(*seen[3], [old]), plain.step(*seen[3]))


def test_an_agent_that_hears_nothing_goes_on_and_says_whom_it_misses() -> None:
    agent, seen = one()
    assert agent.unheard == (1,)
    assert all(np.isfinite(agent.step(*sample)).all() for sample in seen[:3])
    assert agent.unheard == (1,)
    agent.step(*seen[3], [heard(1)])
    assert agent.unheard == ()


def test_telling_changes_nothing() -> None:
    agent, seen = one(network=Network(PERIOD, event=1e-3, receiver="hold"))
    for sample in seen:
        before = agent.state
        first, second = agent.tell(*sample), agent.tell(*sample)
        assert [m.to_bytes() for m in first] == [m.to_bytes() for m in second]
        for name, value in agent.state.items():
            np.testing.assert_array_equal(value, before[name])
        agent.step(*sample)


def test_the_first_message_has_all_that_others_begin_with_and_later_ones_what_receivers_need() -> None:
    agent, seen = one(network=Network(PERIOD))
    (first,) = agent.tell(*seen[0])
    agent.step(*seen[0])
    (second,) = agent.tell(*seen[1])
    assert [len(m.rows) for m in (first, second)] == [3, 1]
    assert [(m.sender, m.stamp) for m in (first, second)] == [(0, 0.0), (0, PERIOD)]


@pytest.mark.parametrize(
    ("subject", "message"),
    [
        ("inbox, sender", Message(0, 0.0, np.zeros((3, 2)))),
        ("inbox, sender", Message(2, 0.0, np.zeros((3, 2)))),
        ("inbox, rows", Message(1, 0.0, np.zeros((2, 2)))),
        ("inbox, rows", Message(1, 0.0, np.zeros((3, 3)))),
        ("inbox, stamp", Message(1, 1.0, np.zeros((3, 2)))),
        ("inbox", heard(0).to_bytes()),
    ],
)
def test_a_message_that_no_neighbour_sent_is_refused_and_leaves_no_trace(subject: str, message) -> None:
    agent, seen = one()
    before = agent.state
    with refused(InputError, subject):
        agent.step(*seen[0], [heard(0), message])
    for name, value in agent.state.items():
        np.testing.assert_array_equal(value, before[name])


def test_a_measurement_that_is_refused_leaves_the_messages_with_the_caller() -> None:
    agent, _ = one()
    with refused(InputError, "q"):
        agent.step(0.0, [np.nan, 0.0], [0.0, 0.0], [heard(0)])
    assert agent.unheard == (1,)
    for call in (agent.step, agent.tell, agent.reset):
        with refused(InputError, "q"):
            call(0.0, np.zeros(3), np.zeros(2))
    with refused(InputError, "v"):
        agent.tell(0.0, [0.0, 0.0], [np.inf, 0.0])


def test_a_sample_that_is_held_hears_all_the_same() -> None:
    agent = small_pair().agents(PERIOD, faults="hold")[0]
    seen = [(t, q[0], v[0]) for t, q, v in measured(small_pair().cell, 3)]
    tau = agent.step(*seen[0])
    np.testing.assert_array_equal(agent.step(seen[1][0], [np.nan, 0.0], [0.0, 0.0], [heard(0)]), tau)
    assert agent.unheard == ()


def test_an_agent_goes_on_from_a_file(tmp_path: Path) -> None:
    agent, seen = one()
    agent.step(*seen[0], [heard(0)])
    path = agent.save(tmp_path / "agent.npz")
    again, _ = one()
    again.load(path)
    np.testing.assert_array_equal(again.step(*seen[1], [heard(1)]), agent.step(*seen[1], [heard(1)]))
    agent.reset(0.0, *seen[0][1:])
    assert agent.unheard == (1,)
    with pytest.raises(ResultError):
        one(network=Network(4e-3, event=1e-3))[0].load(path)


def test_a_desired_motion_of_the_callers_own_replaces_the_robots() -> None:
    (agent, seen), (usual, _) = one(), one()
    xd = agent._loop.cell.references(np.zeros(1))[0].desired[:, 0]
    np.testing.assert_array_equal(agent.step(*seen[0], (), xd), usual.step(*seen[0]))
    assert not np.array_equal(agent.step(*seen[1], (), xd + 0.1), usual.step(*seen[1]))


@pytest.mark.parametrize(
    ("subject", "given"),
    [
        *(
            ("desired", wrong)
            for wrong in (1.0, "x", [[1], [1, 2]], np.zeros((3, 3)), np.full((3, 2), np.nan))
        ),
        *(("inbox", wrong) for wrong in (None, 3, heard(0), heard(0).to_bytes())),
    ],
    ids=repr,
)
def test_what_a_sample_cannot_be_given_is_refused(subject: str, given: object) -> None:
    agent, seen = one()
    with refused(InputError, subject):
        agent.step(*seen[0], **{subject: given})


# -- what cannot be an agent ------------------------------------------------------------------------------


@pytest.mark.parametrize("network", [None, Network(), Network(delay=5e-3)])
def test_agents_need_messages(network: Network | None) -> None:
    with refused(InputError, "network"):
        small_pair(network=network).agents(PERIOD)


@pytest.mark.parametrize("law", [MasterSlave(0), MasterSlave(1)])
def test_a_law_that_needs_more_of_the_others_is_refused_by_name(law: MasterSlave) -> None:
    with refused(InputError, "law") as caught:
        independent(law).agents(PERIOD)
    assert "MasterSlave" in caught.value.found


def test_a_law_that_compares_all_places_is_refused_by_name() -> None:
    four = planar_four()
    gains = four.gains.replace(K_eps=0.0)
    experiment = replace(four, gains=gains, law=ShapeKeeping(), network=Network(4e-3))
    with refused(InputError, "law") as caught:
        experiment.agents(PERIOD)
    assert "ShapeKeeping" in caught.value.found


def test_an_agent_is_made_of_a_controller_with_a_mailbox() -> None:
    whole = small_pair().controller(PERIOD)
    with refused(InputError, "network"):
        Agent(whole.controller, PERIOD)
    with refused(InputError, "controller"):
        Agent(None, PERIOD)


@pytest.mark.parametrize("wrong", ["x", 5.0, [1.0], [[1.0, 2.0]], [-1.0, 1.0], [np.nan, 1.0]])
def test_limits_that_are_none_of_its_joints_are_refused(wrong: object) -> None:
    with refused(InputError, "torque_limits"):
        Agent(one()[0]._loop.controller, PERIOD, torque_limits=wrong)
