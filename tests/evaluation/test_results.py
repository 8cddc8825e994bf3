"""Results of an evaluation in the layout of other tools."""

from wbc_suite.evaluation import Case
from wbc_suite.evaluation.results import collect
from wbc_suite.executors import Outcome, WorkItem


def test_results_have_the_fields_of_lerobot():
    case = Case(benchmark="Lift", robots=("Panda",), policy="hold")
    lines = [
        {"seed": k, "success": k > 0, "succeeded": k > 0, "return": 2.0 * k}
        | {"max_reward": 1.0, "steps": 5, "seconds": 0.1, "physics_error": None}
        for k in range(4)
    ]
    items = {case: [WorkItem(name="a", payload={})]}
    outcomes = [Outcome(name="a", result={"episodes": lines})]
    info = collect(items, outcomes, seconds=8.0).as_lerobot()
    assert info["per_task"] == [
        {
            "task_group": "Lift Panda hold",
            "task_id": 0,
            "metrics": {
                "sum_rewards": [0.0, 2.0, 4.0, 6.0],
                "max_rewards": [1.0] * 4,
                "successes": [False, True, True, True],
                "video_paths": [],
                "predicted_video_paths": [],
            },
        }
    ]
    group = {"avg_sum_reward": 3.0, "avg_max_reward": 1.0, "pc_success": 75.0}
    group |= {"n_episodes": 4, "video_paths": [], "predicted_video_paths": []}
    assert info["per_group"] == {"Lift Panda hold": group}
    assert info["overall"] == group | {"eval_s": 8.0, "eval_ep_s": 2.0}
