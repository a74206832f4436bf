"""Joints: a common protocol, and a file for each type of joint.

A joint has one coordinate, prescribed by a drive or a gear or computed. Each type defines in its file its coordinate,
its constraints, its forces and its free motion. Callers use only `Joint` and `JointPlace`.
"""

from rigid.joints.pin import PinJoint, PinPlace
from rigid.joints.protocol import Body as Body
from rigid.joints.protocol import Coupling, Joint, JointPlace, Placed, carried, opening_of, point_of
from rigid.joints.slider import SliderJoint, SliderPlace
from rigid.joints.weld import WeldJoint
