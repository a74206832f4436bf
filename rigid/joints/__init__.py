"""Joints: a common interface, and a file for each type of joint.

Each joint has one coordinate, which is either prescribed by a drive or gear, or computed. The file of a type of joint
defines the coordinate, constraints, forces and free motion. Callers use `Joint` and `JointPlace` only.
"""

from rigid.joints.pin import PinJoint, PinPlace
from rigid.joints.protocol import Body as Body
from rigid.joints.protocol import Coupling, Joint, JointPlace, Placed, carried, opening_of, point_of
from rigid.joints.slider import SliderJoint, SliderPlace
from rigid.joints.weld import WeldJoint
