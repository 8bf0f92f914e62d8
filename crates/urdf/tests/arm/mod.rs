//! A small arm for the tests: two joints, a fixed flange, friction, limits.

/// The URDF, ten lines to an inertia so that places are easy to count.
pub const URDF: &str = r#"<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial>
      <origin xyz="0.25 0 0" rpy="0 0 0.1"/>
      <mass value="3"/>
      <inertia ixx="0.01" ixy="0.001" ixz="0" iyy="0.06" iyz="0" izz="0.06"/>
    </inertial>
  </link>
  <link name="forearm">
    <inertial>
      <origin xyz="0.2 0 0"/>
      <mass value="2"/>
      <inertia ixx="0.005" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/>
    </inertial>
  </link>
  <link name="flange"/>
  <joint name="shoulder" type="revolute">
    <origin xyz="0 0 0.3"/>
    <parent link="base"/>
    <child link="upper"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="100" velocity="3"/>
    <dynamics damping="0.5" friction="1.5"/>
  </joint>
  <joint name="elbow" type="continuous">
    <origin xyz="0.5 0 0" rpy="0.3 -0.2 0.1"/>
    <parent link="upper"/>
    <child link="forearm"/>
    <axis xyz="0 1 0"/>
  </joint>
  <joint name="flange_fixed" type="fixed">
    <origin xyz="0.4 0 0"/>
    <parent link="forearm"/>
    <child link="flange"/>
  </joint>
</robot>
"#;

/// A sidecar with something of everything.
pub const SIDECAR: &str = r#"# The arm on the bench, measured in March.
format = 1
urdf = "arm.urdf"
gravity = [0.0, 0.0, -9.80665]   # Paris
tool = "flange"
known = "exact"

[joints.shoulder]                # the big one
stiffness = 150                  # N·m/rad, from the static test
damping = 0.5
rotor_inertia = 0.05
gear_ratio = 100.0
rotor_axis = [0, 1, 0]
carried_by = "base"

  # the small one
  [joints.elbow]
  rotor_inertia = 0.01
  torque_constant = 7.5

[links.forearm.bending]
springs = 3
axes = ["y", "z"]
length = 0.4
EI = 1200.0
mass_per_length = 2.1
damping_ratio = 0.01

[[effects]]
kind = "coulomb_friction"
joint = "shoulder"
coulomb = 2.1                    # both directions
coulomb_std = 0.03

[[effects]]                      # what the gripper weighs
kind = "payload"
mass = 0.8
first_moment = [0.0, 0.0, 0.04]

[[effects]]
kind = "contact"
link = "flange"
side = "above"
stiffness = 1e4

# end of file
"#;
