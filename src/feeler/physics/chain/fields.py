"""Rows of the engine's tables: one per quantity, its values segment by segment and lane by lane."""

LANES = 8  # simulations stepped together; two AVX2 or one AVX-512 register per number

# constants of a segment
(
    C_LENGTH,
    C_MASS,
    C_INERTIA,  # about the hinge, m ℓ² / 3
    C_STIFFNESS,
    C_DAMPING,
    C_REST,
    C_RADIUS,
    C_INVWEIGHT,
    C_START,  # arc length of its hinge, and its own length, over the antenna's length
    C_PORTION,
    # of its contacts: greatest impedance, width at rest, the most that slow and any motion make it
    C_D_MAX,
    C_WIDTH,
    C_SLOW,
    C_WIDEST,
    C_K,  # contact stiffness and damping of the reference acceleration [1/ms², 1/ms]
    C_B,
) = range(16)
N_CONSTANTS = 16

# what the whole antenna feels, and its base: a point that moves as it is told to
(
    B_X,  # place [mm], heading [rad] of the base
    B_Y,
    B_HEADING,
    B_VX,  # their rates
    B_VY,
    B_TURN,
    B_AX,  # accelerations during the step
    B_AY,
    B_ALPHA,
    B_FX,  # what the base pushes and turns the antenna with [N, N·mm]
    B_FY,
    B_MOMENT,
    B_WORK,  # [mJ] done so far
    B_PRESS,  # sum of the normal forces of all contacts [N], and of their places weighted by them
    B_PLACE,
    B_SINK,  # deepest contact so far over the smaller radius
    B_GRAVITY_X,  # of everything [mm/ms²]
    B_GRAVITY_Y,
    B_PULL_X,  # constant force at the tip [N]; scenes have none, other users of the sweeps may
    B_PULL_Y,
    # what ``fold_both`` leaves to ``refold``: bias that the last touched segment is shown
    B_LEFT_TORQUE,
    B_LEFT_FX,
    B_LEFT_FY,
    B_REACT_FX,  # and what the base's acceleration adds to its reaction
    B_REACT_FY,
    B_REACT_MOMENT,
) = range(26)
N_BASE = 26

# constants of an object and of its contact
(
    O_ROUNDING,
    O_FRICTION,
    O_D_MIN,  # least impedance
    O_SLOW,  # widths that its motion asks for, if slow and in any case [mm]
    O_FAST,
    O_MIDPOINT,
    O_POWER,
    O_RADIUS,  # of balls and of what is rounded about an edge; else infinite [mm]
) = range(8)
# first row of four half planes that hold it, in its own frame: outward normal (x, y), distance [mm]
O_PLANES = 8
N_PLANES = 4
N_OBJECT = O_PLANES + 3 * N_PLANES

# where an object is, seen from the base; how it moves in the world; what is near it; what it does
(
    P_X,
    P_Y,
    P_FORWARD_X,  # first axis of its frame
    P_FORWARD_Y,
    P_HEADING,  # angle [rad] turned since time 0
    P_VX,
    P_VY,
    P_TURN,
    P_FIRST,  # first and last segment near the object; first > last: none
    P_LAST,
    P_FX,  # force on the antenna [N]
    P_FY,
    P_WORK,  # done on the antenna so far [mJ]
) = range(13)
N_PLACE = 13

KIND_BALL, KIND_BOX, KIND_POLYGON = range(3)  # of a convex part
BLOCK = 8  # [C] parts that are passed by together

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
    # articulated coupling of turning with the hinge's acceleration, over inertia and implicit
    # damping
    W_UX,
    W_UY,
    W_SHARE,  # implicit damping, likewise
    W_U,  # torque left for the hinge, likewise
    W_ALPHA,  # acceleration: turn, hinge (velocity products left out)
    W_AX,
    W_AY,
    W_PX,  # its hinge: place and velocity, seen from the base
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
    # the four rows from W_UX on once more, with damping, while contact is solved without
    W_NEXT_UX,
    _W_NEXT_UY,
    _W_NEXT_SHARE,
    _W_NEXT_U,
    # what ``refold`` needs of ``fold_both``: inertia that a hinge feels, couplings, inverse inertia
    # with damping
    W_D,
    W_DX,
    W_DY,
    W_INVERSE,
) = range(38)
N_WORK = 38

# a contact: object, segment, point and normal (from the object to the segment) seen from the base,
# distance, and its
# place on the segment as a share of the length
T_OBJECT, T_SEGMENT, T_X, T_Y, T_NX, T_NY, T_DISTANCE, T_SHARE = range(8)
N_CONTACT = 8

# a row of the contact problem: a wrench on one segment
(
    R_OBJECT,
    R_SEGMENT,
    R_ARM,  # power of a unit force: velocity of the object's point along the direction
    R_WEIGHT,
    R_AIM,  # reference acceleration
    R_X,  # J q̈ of the iterate
    R_FORCE,  # λ with M (q̈ − a₀) = Jᵀλ at the iterate
    R_NEW_X,
    R_NEW_FORCE,
    R_ACTIVE,
    R_W0,  # lever, direction; in space three numbers each
    R_W1,
    R_W2,
) = range(13)
N_ROW = 13
ROWS = 3  # per contact

# a contact of the step before: object, segment, and J q̈ of each of its rows
M_OBJECT, M_SEGMENT, M_X = range(3)
N_MEMORY = M_X + ROWS


# In space, where they differ; a vector takes three rows, a quantity of the hinges one for each
# plane.

# constants of a segment, behind those of contact in the plane
C_SHARE = N_CONSTANTS  # where its centre of mass lies, over its length
C_LEVER = C_SHARE + 1  # mass times that
C_HINGE = C_SHARE + 2  # inertia across, about the hinge
C_EXCESS = C_SHARE + 3  # that about the axis minus the one before, over length²
C_ACROSS = C_SHARE + 4  # inertia across, about the centre of mass
C_AXIAL = C_SHARE + 5  # that about the axis minus the one before
C_STIFF = C_SHARE + 6
C_DAMP = C_STIFF + 3
C_SLACK = C_DAMP + 3
C_FLOW = C_SLACK + 3  # drag across it, and how much more along it, over its velocity
N_SPACE_CONSTANTS = C_FLOW + 2

# state and workspace of a segment
ANGLE, RATE, TORQUE, LEFT = 0, 3, 6, 9  # by plane; LEFT: torque left over articulated inertia
AXIS = 12  # of each hinge
GAIN = 21  # of each hinge: what a turn and a push of the segment before take from it
SEG_ALONG, OMEGA, MOMENT, FORCE = (
    39,
    42,
    45,
    48,
)  # segment vector, turn rate, velocity-product wrench
ALPHA, PUSH = 51, 54  # acceleration: turn, hinge (velocity products left out)
SEG_PLACE, VELOCITY = 57, 60  # of its hinge, in the world
ADD, BIAS = 63, 84  # contacts' addition to inertia (21) and bias (6)
N_SPACE_WORK = 90

# the base: it moves as it is told to
BASE_PLACE, BASE_TURN, BASE_AXES = 0, 3, 7  # place, quaternion, axes
BASE_V, BASE_OMEGA, BASE_A, BASE_ALPHA = 16, 19, 22, 25
BASE_FORCE, BASE_MOMENT, BASE_GRAVITY = 28, 31, 34
BASE_WORK, BASE_PRESS, BASE_SPOT, BASE_SINK = 37, 38, 39, 40
ROOT, ROOT_V = 41, 44  # hinge 1, which slides in a follicle by GIVE along the base's axes
GIVE, GIVE_RATE, GIVE_OWN, GIVE_FORCE, GIVE_LEFT = 47, 50, 53, 56, 59
GIVE_AXIS, GIVE_ALONG, GIVE_GAIN = 62, 71, 74
GIVE_STIFF, GIVE_DAMP, GIVE_HELD = 92, 95, 98  # HELD: infinite without a follicle
FLOW_V = 99
N_SPACE_BASE = 102

# an object
OBJ_PLACE, OBJ_TURN, OBJ_V, OBJ_OMEGA, OBJ_FORCE, OBJ_WORK = 0, 3, 7, 10, 13, 16
OBJ_AXES = 17
N_SPACE_PLACE = 26

# a solid of an object: object (−1: none), kind, ends in the object's frame (of a box or hull two
# corners around it), and of a hull its faces and edges in the table of hulls
S_OBJECT, S_KIND, S_A, S_B, S_FIRST, S_MIDDLE, S_STOP = 0, 1, 2, 5, 8, 9, 10
N_SOLID = 11
SOLID_BALL, SOLID_CAPSULE, SOLID_WALL, SOLID_BOX, SOLID_HULL = range(5)

# a contact: object, segment, distance, share of the segment, point, normal from the object, and the
# tangent that it asks for
HIT_OBJECT, HIT_SEGMENT, HIT_DISTANCE, HIT_SHARE, HIT_POINT, HIT_NORMAL, HIT_TANGENT = (
    0,
    1,
    2,
    3,
    4,
    7,
    10,
)
N_SPACE_CONTACT = 13

EDGES = 4  # the edges of MuJoCo's pyramid
N_SPACE_ROW = R_W0 + 6
N_SPACE_MEMORY = M_X + EDGES
