//! Robots, excitations and cases shared by the integration stories and the recognition suite.
