"""A plant of one's own: motors whose torque follows what is asked with a lag, T tau_m' = tau - tau_m."""

from synctrl.simulation.plant import Plant

T = 0.002  # s


class LaggingMotors(Plant):
    """Its own state is the torque of the motors, (n, nv), N·m, from rest."""

    @property
    def hidden0(self):
        import numpy as np

        return np.zeros(self.cell.n * self.cell.nv)

    def move(self, q, v, tau, hidden):
        motors = hidden.reshape(q.shape)
        return super().move(q, v, motors, hidden)[0], ((tau - motors) / T).ravel()

    def outputs(self, hidden):
        motors = hidden.reshape(len(hidden), self.cell.n, self.cell.nv)
        return {"motor_torque": (motors, "N·m", ("time", "robot", "joint"))}
