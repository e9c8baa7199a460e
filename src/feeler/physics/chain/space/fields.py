"""Rows of the tables of the chain in space, where they differ from those in the plane; a vector
takes three rows, a quantity of the hinges one for each plane.
"""

from feeler.physics.chain import fields as f

# constants of a segment, behind those of contact in the plane
C_SHARE = f.N_CONSTANTS  # where its centre of mass lies, over its length
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
N_SPACE_ROW = f.R_W0 + 6
N_SPACE_MEMORY = f.M_X + EDGES
