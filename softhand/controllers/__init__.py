"""Control laws: observation in, joint torques out."""

from typing import TYPE_CHECKING

from softhand.plugins import attributes

if TYPE_CHECKING:  # for editors
    from softhand.controllers.angle_feedback import AngleFeedback as AngleFeedback
    from softhand.controllers.arm_pick_and_place import ArmPickAndPlace as ArmPickAndPlace
    from softhand.controllers.blind import Blind as Blind
    from softhand.controllers.computed_torque import ComputedTorque as ComputedTorque
    from softhand.controllers.controller import Controller as Controller
    from softhand.controllers.finger_only import FingerOnly as FingerOnly
    from softhand.controllers.least_squeeze import LeastSqueeze as LeastSqueeze
    from softhand.controllers.object_impedance import ObjectImpedance as ObjectImpedance
    from softhand.controllers.opposing import Opposing as Opposing
    from softhand.controllers.pick_and_place import PickAndPlace as PickAndPlace
    from softhand.controllers.point_contact import PointContact as PointContact
    from softhand.controllers.regulation import Regulation as Regulation
    from softhand.controllers.set_points import SetPoints as SetPoints
    from softhand.controllers.state_feedback import StateFeedback as StateFeedback
    from softhand.controllers.two_phase import TwoPhase as TwoPhase
else:
    __getattr__, __dir__ = attributes("controllers")
