"""A plant of one's own: payloads are at rest until a robot catches them, which jerks it.

The impact is so short that only momentum counts, M+ v+ = M- v-. What is let go of moves on as it did.
"""

import numpy as np

from synctrl.simulation.plant import Plant


class Catching(Plant):
    """It has no state of its own; `self.schedule` knows the robots before and after every edge of a load."""

    @property
    def events(self):
        return [payload.start for payload in self.payloads if payload.start > 0]

    def meet(self, t, q, v, hidden):
        edge, after = self.schedule.edges.index(t), v.copy()
        for i in {payload.robot for payload in self.payloads if payload.start == t}:
            free, loaded = (self.schedule.robots[k][i] for k in (edge, edge + 1))
            joints = slice(free.nv)
            momentum = free.mass_matrix(q[i, joints]) @ v[i, joints]
            after[i, joints] = np.linalg.solve(loaded.mass_matrix(q[i, joints]), momentum)
        return q, after, hidden
