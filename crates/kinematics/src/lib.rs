//! Forward kinematics, geometric Jacobians and Cartesian compliance of robot trees.
