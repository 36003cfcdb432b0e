"""Time integration: a state carried over one step."""

from typing import TYPE_CHECKING

from softhand.plugins import attributes

if TYPE_CHECKING:  # for editors
    from softhand.steppers.adaptive import Adaptive as Adaptive
    from softhand.steppers.midpoint import Midpoint as Midpoint
    from softhand.steppers.rk4 import RungeKutta4 as RungeKutta4
    from softhand.steppers.semi_implicit_euler import SemiImplicitEuler as SemiImplicitEuler
    from softhand.steppers.stepper import Stepper as Stepper
else:
    __getattr__, __dir__ = attributes("steppers")
