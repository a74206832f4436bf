"""Joints: one protocol, and a file for each kind of joint.

A joint has one coordinate, which `rigid` may be told by a drive or a gear, or finds. What a kind of joint is, where its
coordinate is read, what it holds, bears and lets move, stands in its file; who asks goes by `Joint` and `JointPlace`.
"""

from rigid.joints.pin import PinJoint, PinPlace
from rigid.joints.protocol import Body as Body
from rigid.joints.protocol import Coupling, Joint, JointPlace, Placed, carried, opening_of, point_of
from rigid.joints.slider import SliderJoint, SliderPlace
from rigid.joints.weld import WeldJoint
