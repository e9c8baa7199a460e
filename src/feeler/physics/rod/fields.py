"""Columns of the rod's arrays."""

# columns of the antenna's table, one row per segment
R_LENGTH, R_STIFFNESS, R_DAMPING, R_REST, R_RADIUS, R_MASS, R_WEIGHT, R_FIRMNESS = range(8)
# columns of a face: its first point, the unit normal of its free side, its length, and where on its
# part's rim it begins:
# the length of the faces before it [mm] and the turns of the corners before it [rad]
F_X, F_Y, F_NX, F_NY, F_LENGTH, F_START, F_TURN = range(7)
# columns of a convex part: its first face and the one after its last, its object, that one's
# friction and rounding, and
# the length of all faces (infinite for a face without end)
# the last: its radius where it is a ball or a rounded edge, else infinite
P_FIRST, P_STOP, P_OBJECT, P_FRICTION, P_ROUNDING, P_RIM, P_RADIUS = range(7)
# columns of an object: place, first axis, velocity and turn rate
O_X, O_Y, O_FORWARD_X, O_FORWARD_Y, O_VX, O_VY, O_TURN = range(7)
# columns of a contact: depth, normal, place on the rim, force
C_DEPTH, C_NX, C_NY, C_PLACE, C_FX, C_FY = range(6)
N_FACE, N_PART, N_OBJECT, N_CONTACT = 7, 7, 7, 6
