//! Reads URDF and the Sinew sidecar into a robot, and writes the sidecar back.
