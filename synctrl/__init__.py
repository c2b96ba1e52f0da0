"""Adaptive synchronized control of multi-robot cells, after Sun and Mills (2002)."""

from .control.agent import Agent
from .control.controller import Controller
from .control.discrete import DiscreteController
from .control.gains import Gains
from .control.network import Message, Network
from .coupling.cell import Cell, Member
from .coupling.coupling import Coupling
from .coupling.synchronization import SynchronizationFunction
from .coupling.weights import SmoothWeights
from .errors import SynctrlError
from .renamed import serve_old_names
from .robots.base_parameters import BaseParameters
from .robots.catalog import load_robot
from .robots.friction import Friction
from .robots.parameters import FrictionParameters, FullParameters, LinearParameters
from .robots.robot import Robot
from .simulation.mujoco import mujoco_model
from .simulation.result import Result
from .simulation.schedules import Disturbance, Payload
from .simulation.simulate import Experiment, simulate
from .tasks.inverse_kinematics import inverse_kinematics
from .tasks.pose import PoseSpace
from .tasks.poses import Attached, AxisRotation, FunctionOrientation, PoseTrajectory, SmoothOrientation
from .tasks.redundancy import Damping, Redundancy
from .tasks.spaces import CartesianSpace, JointSpace
from .tasks.trajectories import Circle, Cubic, ExponentialApproach, FunctionTrajectory, Hold, SmoothTrajectory

__all__ = [
    "Agent",
    "Attached",
    "AxisRotation",
    "BaseParameters",
    "CartesianSpace",
    "Cell",
    "Circle",
    "Controller",
    "Coupling",
    "Cubic",
    "Damping",
    "DiscreteController",
    "Disturbance",
    "Experiment",
    "ExponentialApproach",
    "Friction",
    "FrictionParameters",
    "FullParameters",
    "FunctionOrientation",
    "FunctionTrajectory",
    "Gains",
    "Hold",
    "JointSpace",
    "LinearParameters",
    "Member",
    "Message",
    "Network",
    "Payload",
    "PoseSpace",
    "PoseTrajectory",
    "Redundancy",
    "Result",
    "Robot",
    "SmoothOrientation",
    "SmoothTrajectory",
    "SmoothWeights",
    "SynchronizationFunction",
    "SynctrlError",
    "inverse_kinematics",
    "load_robot",
    "mujoco_model",
    "simulate",
]

serve_old_names()
