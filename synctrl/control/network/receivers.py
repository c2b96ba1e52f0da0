"""What a robot believes of another between two messages: hold, extrapolate or filter.

With the last message (stamp, W, w, w') and its age, what is believed of W, w and w' is

    hold         W,  w,  w',  until the next message;
    extrapolate  W + age w + age^2/2 w',  w + age w',  w',  up to an age that is its horizon;
    filter       F,  F',  F''  with  F'' = omega^2 (W - F) - 2 omega F',  of messages that have W alone.

Only the filter's are each other's derivatives, so r has no jumps with it, and the proof holds where
K_eps = 0, whatever messages are lost, late or out of order. What is extrapolated is so up to its horizon, but
jumps at messages; what is held stands still. With integrals that leak, F' + leak F and its rate stand in
place of F' and F''.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

Shapes = dict[str, tuple[int, ...]]


class Receiver(Protocol):
    """What is believed of a robot that was heard.

    Attributes:
        rows: how many of W, w and w' a message has.
        jumps: whether what it believes jumps at messages.
    """

    rows: int
    jumps: bool

    def shapes(self, l: int, m: int) -> Shapes:
        """Shapes of what it remembers beside the messages of l links, by name."""

    def believed(self, t: float, now: Any, leak: np.ndarray) -> np.ndarray:
        """W, w and w', (3, l, m); `now` has the parts of the memory, `stamp`, (l,), `held`, (l, rows, m)."""

    def gap(self, t: float, now: Any, leak: np.ndarray) -> np.ndarray:
        """What the rates of W and w as believed have beyond w - leak W and w' as believed, (2, l, m)."""

    def rates(self, now: Any) -> dict[str, np.ndarray]:
        """Rates of what it remembers, by name."""

    def first(self, w: np.ndarray, now: Any) -> None:
        """Begin with what everybody knows of everybody, w of who is heard, (l, m)."""


class Hold:
    """The last message holds until the next one."""

    rows, jumps = 3, True

    def shapes(self, l: int, m: int) -> Shapes:
        return {}

    def believed(self, t: float, now: Any, leak: np.ndarray) -> np.ndarray:
        return now.held.transpose(1, 0, 2)

    def gap(self, t: float, now: Any, leak: np.ndarray) -> np.ndarray:
        W, w, w_dot = self.believed(t, now, leak)
        return self._moves(t, now, leak) - np.array((w - leak * W, w_dot))

    def _moves(self, t: float, now: Any, leak: np.ndarray) -> Any:
        """Rates of W and w as believed."""
        return 0.0

    def rates(self, now: Any) -> dict[str, np.ndarray]:
        return {}

    def first(self, w: np.ndarray, now: Any) -> None:
        """Nothing: it remembers nothing."""


class Extrapolate(Hold):
    """The last message is extrapolated, no further than a horizon, s."""

    def __init__(self, horizon: float):
        self.horizon = horizon

    def believed(self, t: float, now: Any, leak: np.ndarray) -> np.ndarray:
        W, w, w_dot = now.held.transpose(1, 0, 2)
        age = np.clip(t - now.stamp, 0.0, self.horizon)[:, None]
        W_dot, W_ddot = self._derivatives(now, leak)
        return np.array((W + age * W_dot + 0.5 * age**2 * W_ddot, w + age * w_dot, w_dot))

    def _moves(self, t: float, now: Any, leak: np.ndarray) -> np.ndarray:
        age, (W_dot, W_ddot) = (t - now.stamp)[:, None], self._derivatives(now, leak)
        return (age < self.horizon) * np.array((W_dot + age * W_ddot, now.held[:, 2]))

    def _derivatives(self, now: Any, leak: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """W' and W'' where the message was sent."""
        W, w, w_dot = now.held.transpose(1, 0, 2)
        W_dot = w - leak * W
        return W_dot, w_dot - leak * W_dot


class Filter:
    """A filter of second order follows W of the messages, at a rate omega, rad/s."""

    rows, jumps = 1, False

    def __init__(self, omega: float):
        self.omega = omega

    def shapes(self, l: int, m: int) -> Shapes:
        return {"F": (l, m), "F_dot": (l, m)}

    def believed(self, t: float, now: Any, leak: np.ndarray) -> np.ndarray:
        F, F_dot, F_ddot = now.F, now.F_dot, self._accelerate(now)
        return np.array((F, F_dot + leak * F, F_ddot + leak * F_dot))

    def gap(self, t: float, now: Any, leak: np.ndarray) -> np.ndarray:
        return np.zeros((2, *now.F.shape))

    def rates(self, now: Any) -> dict[str, np.ndarray]:
        return {"F": now.F_dot, "F_dot": self._accelerate(now)}

    def first(self, w: np.ndarray, now: Any) -> None:
        now.F[...], now.F_dot[...] = 0.0, w

    def _accelerate(self, now: Any) -> np.ndarray:
        return self.omega**2 * (now.held[:, 0] - now.F) - 2 * self.omega * now.F_dot
