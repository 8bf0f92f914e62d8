"""Makes the Parquet files beside it: pip install pyarrow polars; python make.py

Both hold the same 40 samples, 5 ms apart: q = sin(2 t), u = q / 2 with a gap in the tenth row, an encoder's counts.
"""

import math
from datetime import datetime, timedelta, timezone

import polars
import pyarrow
import pyarrow.parquet

ROWS = range(40)
Q = [math.sin(0.01 * k) for k in ROWS]
U = [None if k == 9 else 0.5 * q for k, q in zip(ROWS, Q)]
COUNTS = [round(1000 * q) - 300 for q in Q]
BEGIN = 1_700_000_000_123_456_789  # ns

# What pandas writes: snappy, dictionaries, time stamps in ns, a text column; rows in three groups.
pyarrow.parquet.write_table(
    pyarrow.table(
        {
            "time": pyarrow.array([BEGIN + 5_000_000 * k for k in ROWS], pyarrow.timestamp("ns", "UTC")),
            "joint_position.elbow": pyarrow.array(Q, pyarrow.float64()),
            "motor_torque.elbow": pyarrow.array(U, pyarrow.float32()),
            "counts": pyarrow.array(COUNTS, pyarrow.int16()),
            "mode": pyarrow.array(["run"] * 40),
            "joint_velocity.elbow": pyarrow.array(["fast"] * 40),
        }
    ),
    "pyarrow.parquet",
    row_group_size=16,
)

# What polars writes: zstd, time stamps in µs.
polars.DataFrame(
    {
        "time": [datetime.fromtimestamp(1_700_000_000, timezone.utc) + timedelta(milliseconds=5 * k) for k in ROWS],
        "joint_position.elbow": Q,
        "motor_torque.elbow": U,
        "counts": polars.Series(COUNTS, dtype=polars.Int64),
    }
).write_parquet("polars.parquet")

# Packed in a way that is not read.
pyarrow.parquet.write_table(
    pyarrow.table({"time": [0.005 * k for k in ROWS], "joint_position.elbow": Q}),
    "brotli.parquet",
    compression="brotli",
    store_schema=False,
)
