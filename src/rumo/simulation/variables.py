"""What a log holds."""

from __future__ import annotations

SKIPPED = "SKIPPED"
"""Status in a log of a sample at which the controller did not run."""

VARIABLES: dict[str, tuple[tuple[str, ...], str]] = {
    "plant": (("plant_state",), "state of the plant"),
    "measured": (("state",), "measured states"),
    "estimated": (("state",), "states given to the controller"),
    "applied": (("input",), "input held from this sample to the next"),
    "commanded": (("input",), "input computed at this sample, applied `delay` samples later"),
    "reference": (("output",), "wanted outputs at this sample"),
    "disturbance": (("parameter",), "parameters of the plant from this sample to the next"),
    "predicted_states": (("stage", "state"), "predicted states, stage 0 is now"),
    "predicted_inputs": (("interval", "input"), "planned inputs, interval 0 starts now"),
    "slacks": (("interval", "constraint"), "violation of the path constraints at the interval's end"),
    "status": ((), "outcome of the step"),
    "cause": ((), "what kept the step from being solved"),
    "health": (
        ("state",),
        "size of a reading's symptom: usual deviations from the prediction, or samples that it is stuck; else 0",
    ),
    "symptom": (("state",), "what is wrong with a reading: held, leaving, stuck, or nothing"),
    "received": (("state",), "measured states as they arrived, faults included"),
    "measured_outputs": (("measured_output",), "further measurements"),
    "received_outputs": (("measured_output",), "further measurements as they arrived, faults included"),
    "estimated_deviation": (("state",), "standard deviation of the estimated states"),
    "estimated_parameters": (("model_parameter",), "parameters that the estimator estimates too"),
    "estimated_biases": (("measurement",), "biases of measurements that the estimator estimates too"),
    "innovation": (("measurement",), "measured less predicted, of the latest sample whose measurements have all come"),
    "innovation_deviation": (("measurement",), "standard deviation that the estimator expects of it"),
    "innovation_used": (
        ("measurement",),
        "1 where the estimate was corrected by it, 0 where it was none or an outlier",
    ),
    "nis": ((), "normalised innovation squared of all measurements used"),
    "true_states": (("state",), "states of the controller's model, of the plant"),
    "true_outputs": (("output",), "tracked outputs, of the plant"),
    "estimated_outputs": (("output",), "tracked outputs at the estimated states"),
    "constraints": (("interval", "constraint"), "planned path constraints at the interval's end, violated above 0"),
    "true_constraints": (("constraint",), "path constraints at the true states, violated above 0"),
    "parameters": (("interval", "model_parameter"), "parameters of the controller's model, as it believes"),
}
"""Dimensions after time, and meaning."""
OBSERVED: dict[str, tuple[tuple[str, ...], str]] = {
    "observed": (("observed_state",), "estimated states of the observed model"),
    "observed_deviation": (("observed_state",), "their standard deviation"),
    "true_observed": (("observed_state",), "states of the observed model, of the plant"),
}
"""Further ones, where the observed model is not the controller's."""
ACTUATED: dict[str, tuple[tuple[str, ...], str]] = {
    "actuated": (("input",), "mean of the plant's input from this sample to the next"),
}
"""Where the scenario says what lies between commands and their effect."""
MONITORED: dict[str, tuple[tuple[str, ...], str]] = {
    "found_delay": (("monitor",), "how late responses are, as found by monitors"),
}
"""Where the scenario has monitors."""
TEXTS = ("status", "cause", "symptom")
"""Of these: no numbers."""
UNITLESS = ("health", "innovation_used", "nis")
"""Of these: in no unit, whatever is the signal's."""
RESCUED = "whether the nonlinear program's solution was the plan, since the iteration's was not to be trusted"
TIMES = ("prepare_time", "feedback_time", "step_time", "waited_time")
OTHERS = (
    "plant",
    "disturbance",
    "received",
    "parameters",
    "estimated_deviation",
    "estimated_parameters",
    "estimated_biases",
    "innovation",
    "observed",
    "observed_deviation",
    "true_observed",
    "actuated",
    "found_delay",
    "true_states",
    "true_outputs",
)
"""What loops may know besides."""
