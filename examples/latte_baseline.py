"""LaTTe (Bucker et al. 2022) as a baseline of `ovita bench`: an adapter around a checkout of its authors' code.

The code and the weights are not ours and come with no licence, so ovita ships neither. In an environment of their own
(Python 3.8, TensorFlow, PyTorch, CLIP, as their README says), with the model file that it links to:

    ovita bench run scenes --timeout 900 --writer "exec:PYTHON latte_baseline.py CHECKOUT MODEL.h5"

where PYTHON is that environment's own. It needs numpy and the checkout only, not ovita. One line of JSON in is one line
of JSON out, so that the model is loaded once; what the checkout prints goes to standard error.
"""

import json
import os
import sys

import numpy as np

WAYPOINTS, MOST_OBJECTS = 40, 6
MARGIN, LOCALITY = 0.45, 0.5  # the size of the training scenes; the locality of OVITA's comparison


def normalised(path, objects):
    """Path (N, 4) and objects (K, 3) in LaTTe's box, with the inverse for rows (N, 4).

    Positions share one scale on all axes; speeds have their own, their spread, or their size where they are constant.
    """
    points = np.concatenate([path[:, :3], objects])
    low, high = points.min(axis=0), points.max(axis=0)
    slow, fast = path[:, 3].min(), path[:, 3].max()
    spread = max(fast - slow, 1e-6) if fast - slow > 1e-9 else max(fast, 1e-6)
    scale = np.append(np.full(3, max((high - low).max(), 1e-6)), spread) / (1.0 - MARGIN)
    middle = np.append((low + high) / 2.0, (slow + fast) / 2.0)

    def inverse(rows):
        back = rows * scale + middle
        return np.column_stack([back[:, :3], np.maximum(back[:, 3], 0.0)])

    return (path - middle) / scale, (objects - middle[:3]) / scale[:3], inverse


def by_index(path, n):
    """Rows (N, 4) at n indices spread evenly."""
    at = np.linspace(0.0, len(path) - 1.0, n)
    return np.column_stack([np.interp(at, np.arange(len(path)), column) for column in path.T])


def answer(question, refiner, model):
    """A request's answer: the trajectory with LaTTe's 40 waypoints."""
    objects = question["objects"]
    if not 1 <= len(objects) <= MOST_OBJECTS:
        return {"error": f"LaTTe takes 1 to {MOST_OBJECTS} objects, not {len(objects)}"}
    if question["frame"] != "rfu":
        return {"error": f"LaTTe's scenes are in the frame rfu, not {question['frame']}"}
    rows = np.array([row[:4] for row in question["trajectory"]], dtype=float)
    places = np.array([[item[axis] for axis in "xyz"] for item in objects], dtype=float)
    path, places, inverse = normalised(by_index(rows, WAYPOINTS), places)
    sample = {
        "input_traj": path,
        "output_traj": None,
        "text": question["instruction"],
        "obj_names": [item["name"] for item in objects],
        "obj_poses": places,
        "locality_factor": LOCALITY,
        "image_paths": None,
    }
    said, _ = refiner.apply_interaction(model, sample, question["instruction"], label=False)
    return {"trajectory": inverse(np.asarray(said, dtype=float)[0]).tolist()}


def main(checkout, weights):
    """Answer requests until standard input ends."""
    answers, sys.stdout = sys.stdout, sys.stderr
    sys.path.insert(0, os.path.join(checkout, "src"))
    from motion_refiner_4D import Motion_refiner
    from TF4D_mult_features import load_model

    refiner = Motion_refiner(traj_n=WAYPOINTS, load_models=True, locality_factor=True, poses_on_features=True)
    model = load_model(weights, delimiter="-")
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line), refiner, model)), file=answers, flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: latte_baseline.py CHECKOUT MODEL.h5")
    main(*sys.argv[1:])
