"""An engine of one's own: the trapezoidal predictor-corrector of second order, for continuous control."""

from synctrl.simulation.engines import collect


class Heun:
    def refuses(self, run):
        return None if run.every is None else "Heun does not have sampled control; use engine='pinocchio'"

    def run(self, run, progress):
        run.info["engine"] = "Heun"
        return collect(run, run.samples(self), progress)

    def carry(self, control, step, y, rate):
        ahead, slope = step.loop.state(y.flat + step.h * rate.flat), step.loop.state()
        control.rate(step, step.stages[2], ahead, slope)
        after = step.loop.state(y.flat + 0.5 * step.h * (rate.flat + slope.flat))
        control.arrive(step, after)
        return after
