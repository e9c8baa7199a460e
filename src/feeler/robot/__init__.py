"""The robotic antenna: hinges, sensor calibration, recordings, surrogate robot, transfer."""

from feeler.renamed import find_renamed
from feeler.robot.classify import (
    Touches,
    TrainingSet,
    align_recordings,
    draw_robots,
    draw_training_set,
    make_classifier,
    make_decoder,
    make_training,
    measure_transfer,
    sweep_shots,
    touch_robots,
)
from feeler.robot.decoder import RobotDecoder, train_decoder
from feeler.robot.description import (
    ROBOT_FACTS,
    Flexures,
    RobotFile,
    compute_tip,
    get_label,
    load_robot,
    make_flexures,
    make_robot,
    make_touches,
    simulate_touches,
    write_robot,
)
from feeler.robot.fit import (
    RobotFit,
    compare_tips,
    fit_factors,
    make_posture,
    simulate_release,
)
from feeler.robot.recordings import Recording, load_recording, save_recording
from feeler.robot.repair import make_dataset, repair
from feeler.robot.sensors import (
    SensorCalibration,
    load_calibration,
    load_calibration_table,
    save_calibration,
)
from feeler.robot.surrogate import (
    Gap,
    Surrogate,
    make_surrogate,
    subtract_rest,
)

__all__ = [
    "ROBOT_FACTS",
    "Flexures",
    "Gap",
    "Recording",
    "RobotDecoder",
    "RobotFile",
    "RobotFit",
    "SensorCalibration",
    "Surrogate",
    "Touches",
    "TrainingSet",
    "align_recordings",
    "compare_tips",
    "compute_tip",
    "draw_robots",
    "draw_training_set",
    "fit_factors",
    "get_label",
    "load_calibration",
    "load_calibration_table",
    "load_recording",
    "load_robot",
    "make_classifier",
    "make_dataset",
    "make_decoder",
    "make_flexures",
    "make_posture",
    "make_robot",
    "make_surrogate",
    "make_touches",
    "make_training",
    "measure_transfer",
    "repair",
    "save_calibration",
    "save_recording",
    "simulate_release",
    "simulate_touches",
    "subtract_rest",
    "sweep_shots",
    "touch_robots",
    "train_decoder",
    "write_robot",
]

__getattr__ = find_renamed(__name__)
__dir__ = __all__.copy
