"""Complete state of a simulation, to go on from exactly.

MuJoCo's own state leaves out which bodies sleep; without it a restored world would wake up and differ.
"""

from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array

_PARTS = mujoco.mjtState.mjSTATE_INTEGRATION

Sleep = npt.NDArray[np.int32]


def read_state(model: Any, data: Any) -> tuple[Array, Sleep]:
    """The integration state and each tree's sleep counter."""
    numbers = np.zeros(mujoco.mj_stateSize(model, _PARTS))
    mujoco.mj_getState(model, data, numbers, _PARTS)
    return numbers, np.array(data.tree_asleep, dtype=np.int32)


def write_state(model: Any, data: Any, numbers: Array, asleep: Sleep) -> None:
    """Put a simulation back to where `read_state` found it."""
    mujoco.mj_setState(model, data, numbers, _PARTS)
    data.tree_asleep[:] = -1 - mujoco.mjMINAWAKE
    _derive(model, data)
    mujoco.mj_forward(model, data)  # sleeping bodies too need their places computed once
    mujoco.mj_setState(model, data, numbers, _PARTS)
    data.tree_asleep[:] = asleep
    _derive(model, data)


def wake(model: Any, data: Any, tree: int) -> None:
    """Wake a tree of bodies and all that sleep leaning on it."""
    asleep = data.tree_asleep
    while asleep[tree] >= 0:
        tree, asleep[tree] = asleep[tree], -1 - mujoco.mjMINAWAKE
    _derive(model, data)


def _derive(model: Any, data: Any) -> None:
    """Bring the lists of awake things in line with the trees' sleep counters."""
    awake = data.tree_asleep < 0
    tree = model.body_treeid
    static, sleeping, waking = -1, 0, 1
    body = np.where(tree < 0, static, np.where(awake[np.maximum(tree, 0)], waking, sleeping))
    body[(tree < 0) & (model.body_mocapid[model.body_rootid] >= 0)] = waking
    data.tree_awake[:] = awake
    data.ntree_awake = int(awake.sum())
    data.body_awake[:] = body
    data.nbody_awake = _list(data.body_awake_ind, body != sleeping)
    parents = body[model.body_parentid] != sleeping
    parents[0] = False
    data.nparent_awake = _list(data.parent_awake_ind, parents)
    data.nv_awake = _list(data.dof_awake_ind, body[model.dof_bodyid] == waking)


def _list(indices: Any, chosen: npt.NDArray[np.bool_]) -> int:
    found = np.flatnonzero(chosen)
    indices[: len(found)] = found
    return len(found)
