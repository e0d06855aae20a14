// A tree of lamps, for scenes of many: a place goes down from the root to one of them, by what nodes could bring to it (Conty Estevez and
// Kulla 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting), and rays look only into boxes that they enter. The host
// writes it depth first behind what lights have read (`clfractal/shading/light_tree.py`): the second child stands where the first one ends.
#include "device/gather.h"

#define TREE_NODE 21
enum { TREE_MIDDLE = 0, TREE_RADIUS = 3, TREE_POWER, TREE_STEADY, TREE_AXIS, TREE_CORE = 9, TREE_BEYOND = 11, TREE_LOW, TREE_HIGH = 15, TREE_END = 18, TREE_LAMP, TREE_SEEN };
#define IS_BEAMED(tree) ((tree)[TREE_BEYOND] < 2.0f)   // ALL_AROUND in clfractal/shading/light_tree.py
#define TREE_BEHIND R(0.05)   // of a place that faces a node what one has that does not: light comes through surfaces, too

// An angle up to half a turn.
typedef struct {
    real cosine, sine;
} tree_angle;

INLINE tree_angle tree_between(vec a, vec b) {
    const real cosine = bounded(vec_dot(a, b), R(-1.0), R(1.0));
    return (tree_angle){cosine, sqrt(R(1.0) - cosine * cosine)};
}

// What is left of an angle without another, or 0.
INLINE tree_angle tree_without(tree_angle a, tree_angle b) {
    const mask within = less_equal(b.cosine, a.cosine);
    return (tree_angle){pick(within, R(1.0), a.cosine * b.cosine + a.sine * b.sine), pick(within, R(0.0), a.sine * b.cosine - a.cosine * b.sine)};
}

INLINE vec tree_vec(__global const float *tree, ints node, int first) {
    return vec_of(gather_floats(tree, node + first), gather_floats(tree, node + first + 1), gather_floats(tree, node + first + 2));
}

// About the irradiance that lamps of a node can bring to a place, and for a surface with that normal what of it counts.
typedef struct {
    real all, facing;
} tree_weight;

// `node`: where its numbers begin. No normal: all counts.
INLINE tree_weight tree_weight_of(__global const float *tree, ints node, vec from, vec normal) {
    const vec offset = vec_sub(tree_vec(tree, node, TREE_MIDDLE), from);
    const real radius = gather_floats(tree, node + TREE_RADIUS), reach = radius * radius;
    const real square = most(vec_dot(offset, offset), (real)(REAL_SMALLEST)), inverse = real_rsqrt(square);
    const vec toward = vec_scale(offset, inverse);
    // The angle of the ball in which they stand: from within it may be any.
    const real sine = least(radius * inverse, R(1.0));
    const mask outside = less(reach, square);
    const tree_angle spread = {pick(outside, sqrt(R(1.0) - sine * sine), R(-1.0)), pick(outside, sine, R(0.0))};
    real shines = R(1.0);
    // (Most lamps shine all around: a tree of such alone says so at its root, and has no axis to ask for.)
    const real even = IS_BEAMED(tree) ? gather_floats(tree, node + TREE_CORE) : R(-1.0);
    if (any_lane(less(R(-1.0), even))) {
        const tree_angle core = {even, gather_floats(tree, node + TREE_CORE + 1)};
        const vec axis = tree_vec(tree, node, TREE_AXIS);
        const tree_angle beyond = tree_without(tree_without(tree_between(axis, vec_scale(toward, R(-1.0))), core), spread);
        shines = pick(less_equal(gather_floats(tree, node + TREE_BEYOND), beyond.cosine), most(beyond.cosine, R(0.0)), R(0.0));
    }
    tree_weight found;
    const real steady = tree[TREE_STEADY] > 0.0f ? gather_floats(tree, node + TREE_STEADY) : R(0.0);
    found.all = shines * (steady + gather_floats(tree, node + TREE_POWER) / most(square, reach));
    const real faces = most(tree_without(tree_between(normal, toward), spread).cosine, R(0.0));
    found.facing = found.all * pick(less(R(0.5), vec_dot(normal, normal)), TREE_BEHIND + faces, R(1.0));
    return found;
}

// What all lamps of the tree weigh at a place.
CALLED real tree_total(const vec *from, __global const float *tree) {
    const vec none = vec_of(R(0.0), R(0.0), R(0.0));
    return tree_weight_of(tree, to_ints(R(0.0)), *from, none).all;
}

// One lamp, and the parts of the tree's weight that it has: that with which it is chosen at a surface, and that without a normal; and what is
// left of the number that has chosen it, in [0, 1).
typedef struct {
    real lamp, share, even, left;
} tree_choice;

INLINE real tree_part(real one, real other) {
    const real sum = one + other;
    return pick(less(R(0.0), sum), one / pick(less(R(0.0), sum), sum, R(1.0)), R(0.5));
}

// Goes down from the root: to the lamp that `place` in [0, 1) chooses; or with `known` to the lamp with that number.
CALLED tree_choice tree_descent(const vec *from, const vec *normal, int known, real place, mask active, __global const float *tree) {
    tree_choice found = {R(0.0), R(1.0), R(1.0), R(0.0)};
    ints node = to_ints(R(0.0));
    for (;;) {
        const real end = gather_floats(tree, node + TREE_END);
        const mask inner = active & less(to_reals(node) + (real)(TREE_NODE), end * (real)(TREE_NODE));
        if (!any_lane(inner)) break;
        const ints first = pick_ints(inner, node + TREE_NODE, 0);
        const ints second = pick_ints(inner, TREE_NODE * to_ints(gather_floats(tree, first + TREE_END)), 0);
        const tree_weight a = tree_weight_of(tree, first, *from, *normal), b = tree_weight_of(tree, second, *from, *normal);
        const real left = tree_part(a.facing, b.facing), right = tree_part(b.facing, a.facing);
        const mask goes_right = known ? less_equal(gather_floats(tree, second + TREE_LAMP), place) : less_equal(left, place);
        found.share = pick(inner, found.share * pick(goes_right, right, left), found.share);
        const real even = tree_part(pick(goes_right, b.all, a.all), pick(goes_right, a.all, b.all));
        found.even = pick(inner, found.even * even, found.even);
        const real rest = pick(goes_right, place - left, place) / most(pick(goes_right, right, left), (real)(REAL_SMALLEST));
        if (!known) place = pick(inner, bounded(rest, R(0.0), R(1.0) - (real)(REAL_EPSILON)), place);
        node = pick_ints(inner, pick_ints(goes_right, second, first), node);
    }
    found.lamp = gather_floats(tree, node + TREE_LAMP);
    found.left = place;
    return found;
}

// Lamps that a ray may meet, one after the other: those beside the tree, and those of it whose boxes it enters.
typedef struct {
    int lamp, node;
} lamp_turn;

INLINE real tree_inverse(real a) { return R(1.0) / pick(less(fabs(a), R(1e-20)), R(1e-20), a); }

INLINE mask tree_entered(__global const float *node, vec origin, vec inverse, real far) {
    const vec a = vec_mul(vec_sub(vec_splat(node + TREE_LOW), origin), inverse), b = vec_mul(vec_sub(vec_splat(node + TREE_HIGH), origin), inverse);
    const real entry = most(most(least(a.x, b.x), least(a.y, b.y)), most(least(a.z, b.z), R(0.0)));
    const real exit = least(least(most(a.x, b.x), most(a.y, b.y)), most(a.z, b.z)) * (R(1.0) + R(8.0) * (real)(REAL_EPSILON));
    return less_equal(entry, exit) & less(entry, far);
}

// The number of the next one, or -1, and which lanes ask it: of a lamp in the tree those that enter its own box, whatever others enter. (Boxes
// hold those below them to the last bit, so such a lane enters all of them.) `singles` are beside the tree.
INLINE int next_lamp(lamp_turn *turn, int singles, int nodes, __global const float *tree, vec origin, vec inverse, real far, mask *asks) {
    *asks = less(R(0.0), R(1.0));
    if (turn->lamp < singles) return turn->lamp++;
    while (turn->node < nodes) {
        __global const float *node = tree + TREE_NODE * turn->node;
        const int end = (int)node[TREE_END];
        *asks = tree_entered(node, origin, inverse, far);
        if (node[TREE_SEEN] == 0.0f || !any_lane(*asks)) {
            turn->node = end;
            continue;
        }
        turn->node += 1;
        if (end == turn->node) return (int)node[TREE_LAMP];
    }
    return -1;
}
