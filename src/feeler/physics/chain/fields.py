"""Rows of the engine's tables: one per quantity, its values segment by segment and lane by lane."""

# constants of a segment
(
    C_LENGTH,
    C_MASS,
    C_INERTIA,  # about the hinge, m ℓ² / 3
    C_STIFFNESS,
    C_DAMPING,
    C_REST,
    C_RADIUS,
    C_REACH,  # length plus radius
    C_INVWEIGHT,
) = range(9)
N_CONSTANTS = 9

# constants of the object and of its contact
(
    O_BASE,  # heading of the antenna's base [rad]
    O_FORWARD_X,
    O_FORWARD_Y,
    O_LOW_X,  # bounding box in the feature's frame [mm]
    O_LOW_Y,
    O_HIGH_X,
    O_HIGH_Y,
    O_MIDDLE_X,  # its middle and half its size
    O_MIDDLE_Y,
    O_HALF_X,
    O_HALF_Y,
    O_RADIUS,
    O_FRICTION,
    O_K,  # contact stiffness and damping of the reference acceleration [1/ms², 1/ms]
    O_B,
    O_MIN_IMPEDANCE,
    O_MAX_IMPEDANCE,
    O_WIDTH,
    O_MIDPOINT,
    O_POWER,
    O_GRAVITY_X,  # of everything [mm/ms²]; scenes have none, other users of the sweeps may
    O_GRAVITY_Y,
    O_PULL_X,  # constant force at the tip [N], likewise
    O_PULL_Y,
) = range(24)
N_OBJECT = 24

# the object's place and velocity, and what is near it
(
    P_X,
    P_Y,
    P_VX,
    P_VY,
    P_FIRST,  # first and last segment near the object; first > last: none
    P_LAST,
) = range(6)
N_PLACE = 6

KIND_NONE, KIND_BALL, KIND_BOX, KIND_POLYGON = range(4)

# state and workspace of a segment
(
    W_ANGLE,
    W_RATE,
    W_HEADING,  # of the segment
    W_OMEGA,  # its turn rate
    W_QDD,  # acceleration of its hinge
    W_EX,  # vector from its hinge to the next [mm]
    W_EY,
    W_TORQUE,  # passive torque of its hinge
    W_FX,  # minus mass times velocity-product acceleration of its centre
    W_FY,
    W_UX,  # articulated coupling of turning with the hinge's acceleration, over inertia and implicit damping
    W_UY,
    W_SHARE,  # implicit damping, likewise
    W_U,  # torque left for the hinge, likewise
    W_ALPHA,  # acceleration: turn, hinge (velocity products left out)
    W_AX,
    W_AY,
    W_PX,  # its hinge: place, velocity
    W_PY,
    W_VX,
    W_VY,
    W_K00,  # contacts' addition to the segment's inertia and bias
    W_K01,
    W_K02,
    W_K11,
    W_K12,
    W_K22,
    W_B0,
    W_B1,
    W_B2,
) = range(30)
N_WORK = 30
