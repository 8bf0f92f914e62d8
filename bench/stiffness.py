"""The Cartesian compliance of a robot in many configurations with NumPy and Pinocchio's Jacobian, timed.

    pip install pin numpy
    cargo build --release -p sinew-bench --bin stiffness
    target/release/stiffness ROBOT.urdf TOOL q.bin      # Sinew; writes the configurations
    python bench/stiffness.py ROBOT.urdf TOOL q.bin     # the same here; the sums must agree

Two forms: J K^-1 J^T configuration by configuration, as most people write it, and the Jacobians one by one but all products
in one call of einsum. CPU time, so that other work on the machine counts little.
"""
import sys
import time

import numpy as np
import pinocchio as pin

CALLS = 3


def main(urdf, tool, file):
    model = pin.buildModelFromUrdf(urdf)
    data, frame = model.createData(), model.getFrameId(tool)
    q = np.fromfile(file).reshape(-1, model.nv)
    assert model.nq == model.nv, "joints with one number each"
    springs = 1.0 / (1000.0 + 100.0 * np.arange(model.nv))
    world_aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def one_by_one():
        out = np.empty((len(q), 6, 6))
        for k, x in enumerate(q):
            J = pin.computeFrameJacobian(model, data, x, frame, world_aligned)
            out[k] = (J * springs) @ J.T
        return out

    def products_at_once():
        J = np.empty((len(q), 6, model.nv))
        for k, x in enumerate(q):
            J[k] = pin.computeFrameJacobian(model, data, x, frame, world_aligned)
        return np.einsum("kia,a,kja->kij", J, springs, J, optimize=True)

    for name, compute in (("one by one", one_by_one), ("products at once", products_at_once)):
        samples = []
        for _ in range(CALLS):
            start = time.process_time()
            C = compute()
            samples.append((time.process_time() - start) / len(q) * 1e9)
        print(f"{model.name},compliance {name},numpy+pinocchio,{min(samples):.1f},{sorted(samples)[CALLS // 2]:.1f}")
    print(f"{model.name},sum of all entries,numpy+pinocchio,{C.sum():.12e}")


if __name__ == "__main__":
    main(*sys.argv[1:])
