"""The robotic antenna: hinges, sensor calibration, recordings, surrogate robot, transfer."""

from feeler.robot.comparison import compute_comparison, make_profiles
from feeler.robot.dataset import make_dataset
from feeler.robot.description import RobotFile, load_robot, write_robot
from feeler.robot.factors import (
    RobotFit,
    compare_tips,
    fit_factors,
    make_posture,
    measure_ringing,
    simulate_release,
    solve_factors,
)
from feeler.robot.gap import Gap
from feeler.robot.hinge import ROBOT_FACTS, Flexures, make_flexures
from feeler.robot.lessons import Lessons, draw_lessons, make_classifier
from feeler.robot.mending import find_bad_channels, repair
from feeler.robot.parts import PARTS, keep_parts, measure_parts
from feeler.robot.preset import make_robot
from feeler.robot.reality import (
    Touches,
    add_robots,
    align_recordings,
    choose_before,
    draw_robots,
    make_decoder,
    make_training,
    measure_transfer,
    read_touches,
    sweep_shots,
    touch_robots,
)
from feeler.robot.recording import Recording, load_recording, save_recording
from feeler.robot.sensor import SensorCalibration, fit_sensors, load_calibration_table
from feeler.robot.sensor_file import load_calibration, save_calibration
from feeler.robot.surrogate import Surrogate, make_surrogate, make_tip_touches, subtract_rest
from feeler.robot.touches import compute_tip, get_label, make_touches, simulate_touches

__all__ = [
    "PARTS",
    "ROBOT_FACTS",
    "Flexures",
    "Gap",
    "Lessons",
    "Recording",
    "RobotFile",
    "RobotFit",
    "SensorCalibration",
    "Surrogate",
    "Touches",
    "add_robots",
    "align_recordings",
    "choose_before",
    "compare_tips",
    "compute_comparison",
    "compute_tip",
    "draw_lessons",
    "draw_robots",
    "find_bad_channels",
    "fit_factors",
    "fit_sensors",
    "get_label",
    "keep_parts",
    "load_calibration",
    "load_calibration_table",
    "load_recording",
    "load_robot",
    "make_classifier",
    "make_dataset",
    "make_decoder",
    "make_flexures",
    "make_posture",
    "make_profiles",
    "make_robot",
    "make_surrogate",
    "make_tip_touches",
    "make_touches",
    "make_training",
    "measure_parts",
    "measure_ringing",
    "measure_transfer",
    "read_touches",
    "repair",
    "save_calibration",
    "save_recording",
    "simulate_release",
    "simulate_touches",
    "solve_factors",
    "subtract_rest",
    "sweep_shots",
    "touch_robots",
    "write_robot",
]
