"""An engine of one's own: the trapezoidal predictor-corrector of second order, for continuous control."""

from synctrl.simulation.integrators import Sample, final, steps
from synctrl.simulation.run import collect


class Heun:
    def refuses(self, run):
        return None if run.every is None else "Heun does not have sampled control; use engine='pinocchio'"

    def run(self, run, progress):
        run.info["engine"] = "Heun"
        return collect(run, self.samples(run), progress)

    def samples(self, run):
        y = run.loop.initial_state()
        for step in steps(run.loop, run.clock, run.schedule):
            push, h = run.schedule.torques[step.window], step.t_next - step.t
            now = run.loop.at(0.5 * (step.t + step.t_next))
            rate, signals = now.evaluate(step.stages[0], y, push)
            if step.checked:
                yield Sample(step.t, y, push, signals, step.logged)
            ahead, _ = now.evaluate(step.stages[2], y + h * rate, push)
            y = y + 0.5 * h * (rate + ahead)
        yield final(run.loop, run.clock, y, push)
