// Water with waves: the height over a plane is a sum of a (cos p + s cos 2p), p = x u + y v + phase (see clfractal/geometry/water.py).
#define WATER_STEPS 160       // most steps of a search; a ray that has not arrived meets the plane in the middle of the waves
#define WATER_NEAR R(0.05)    // of a footprint: so near above the water steps become no shorter
#define WATER_HALVINGS 10     // of such a step

// Sine and cosine of a phase in radians; by polynomials over half a turn (least squares at Chebyshev's nodes) as exact as float32 is.
INLINE void wave_turn(real phase, real *sine, real *cosine) {
    const real turns = phase * R(0.15915494309189535), r = turns - floor(turns + R(0.5));
#if REAL_IS_DOUBLE
    *sine = sin(R(6.283185307179586) * r);
    *cosine = cos(R(6.283185307179586) * r);
#else
    const real x = r * r;
    const real s = r * (R(3.14159264) + x * (R(-5.16771008) + x * (R(2.55007752) + x * (R(-0.59829129) + x * R(0.07765766)))));
    const real c = R(1.0) + x * (R(-4.93480214) + x * (R(4.05870916) + x * (R(-1.335212) + x * (R(0.23493731) + x * R(-0.02439633)))));
    *sine = R(2.0) * s * c;
    *cosine = R(1.0) - R(2.0) * s * s;
#endif
}

INLINE real wave_phase(object_record o, int i, real u, real v) {
    return (real)(o->wave_x[i]) * u + (real)(o->wave_y[i]) * v + (real)(o->wave_phase[i]);
}

// The height over a place of the plane, scene units, and how it changes on a way along the plane.
INLINE real water_height(object_record o, real u, real v, vec way, real *change) {
    real sum = R(0.0), slope = R(0.0);
    for (int i = 0; i < WAVES; ++i) {
        real sine, cosine;
        wave_turn(wave_phase(o, i, u, v), &sine, &cosine);
        const real height = (real)(o->wave_height[i]), sharp = (real)(o->wave_sharp);
        // cos 2p = 2 cos^2 p - 1, sin 2p = 2 sin p cos p
        sum += height * (cosine + sharp * (R(2.0) * cosine * cosine - R(1.0)));
        slope -= height * sine * (R(1.0) + R(4.0) * sharp * cosine) * ((real)(o->wave_x[i]) * way.x + (real)(o->wave_y[i]) * way.y);
    }
    *change = slope;
    return sum;
}

// The normal over a place of the plane in its own frame; not of length 1.
INLINE vec water_normal(object_record o, real u, real v) {
    vec normal = vec_of(R(0.0), R(0.0), R(1.0));
    for (int i = 0; i < WAVES; ++i) {
        real sine, cosine;
        wave_turn(wave_phase(o, i, u, v), &sine, &cosine);
        const real rise = (real)(o->wave_height[i]) * sine * (R(1.0) + R(4.0) * (real)(o->wave_sharp) * cosine);
        normal.x += rise * (real)(o->wave_x[i]);
        normal.y += rise * (real)(o->wave_y[i]);
    }
    return normal;
}

// The height over a place of the plane, its slopes along the plane's axes, and how these change along them.
typedef struct {
    real height, slope_x, slope_y, bend_x, bend_y, bend_both;
} water_shape;

INLINE water_shape water_shape_at(object_record o, real u, real v) {
    water_shape s = {R(0.0), R(0.0), R(0.0), R(0.0), R(0.0), R(0.0)};
    for (int i = 0; i < WAVES; ++i) {
        real sine, cosine;
        wave_turn(wave_phase(o, i, u, v), &sine, &cosine);
        const real height = (real)(o->wave_height[i]), sharp = (real)(o->wave_sharp), x = (real)(o->wave_x[i]), y = (real)(o->wave_y[i]);
        const real twice = R(2.0) * cosine * cosine - R(1.0);
        const real slope = -height * sine * (R(1.0) + R(4.0) * sharp * cosine), bend = -height * (cosine + R(4.0) * sharp * twice);
        s.height += height * (cosine + sharp * twice);
        s.slope_x += slope * x;
        s.slope_y += slope * y;
        s.bend_x += bend * x * x;
        s.bend_y += bend * y * y;
        s.bend_both += bend * x * y;
    }
    return s;
}

// How much the height over a way can change, at most, and how much that change can.
INLINE void water_limits(object_record o, vec way, real *slope, real *bend) {
    real first = R(0.0), second = R(0.0);
    for (int i = 0; i < WAVES; ++i) {
        const real turn = fabs((real)(o->wave_x[i]) * way.x + (real)(o->wave_y[i]) * way.y), rise = (real)(o->wave_height[i]) * turn;
        first += rise;
        second += rise * turn;
    }
    *slope = first * (real)(S(1.0) + S(2.0) * o->wave_sharp);
    *bend = second * (real)(S(1.0) + S(4.0) * o->wave_sharp);
}

// A step that is safe at a height over the water which changes so, where it falls no faster than `fall` (Hart 1996) and bends no more
// than `bend`: up to the first place where the parabola below it is 0.
INLINE real water_step(real height, real change, real fall, real bend) {
    const real root = sqrt(change * change + R(2.0) * bend * height);
    const mask rises = less(R(0.0), change);
    const real by_bend = pick(rises, change + root, R(2.0) * height) / fmax(pick(rises, bend, root - change), R(1e-20));
    return fmax(by_bend, height / fall);
}

// How far along a ray water is met before `far`, or the largest number; `from` and `way` in the plane's frame.
INLINE real water_met(object_record o, vec from, vec way, real far, real footprint, real spread) {
    const real reach = (real)(o->wave_reach), level = divisor(way.z);
    const mask flat = less(fabs(way.z), R(1e-9)), within = less_equal(fabs(from.z), reach);
    const real a = (reach - from.z) / level, b = (-reach - from.z) / level;
    const real begin = fmax(pick(flat, R(0.0), fmin(a, b)), R(0.0));
    const real end = fmin(pick(flat, pick(within, R(1e6) * reach, R(-1.0)), fmax(a, b)), far);
    mask active = less_equal(begin, end);
    real t = begin, before = begin, found = (real)(REAL_LARGEST);
    if (!any_lane(active)) return found;
    real slope, bend, change, side = R(1.0);
    water_limits(o, way, &slope, &bend);
    const real fall = fabs(way.z) + slope;
    mask crossed = active & ~active;
    for (int step = 0; step < WATER_STEPS; ++step) {
        real height = from.z + t * way.z - water_height(o, from.x + t * way.x, from.y + t * way.y, way, &change);
        // Above the water or below: as the ray begins. (At the rim of the waves, where it enters them, a rounded height may lie.)
        if (step == 0) side = pick(less(pick(less(R(0.0), begin), from.z, height), R(0.0)), R(-1.0), R(1.0));
        height *= side;
        const mask here = active & less_equal(height, R(0.0));
        crossed |= here;
        found = pick(here, t, found);
        active &= ~here;
        if (!any_lane(active)) break;
        const real shortest = WATER_NEAR * (footprint + spread * t) + R(4.0) * (real)(REAL_EPSILON) * (fabs(t) + reach);
        before = pick(active, t, before);
        t = pick(active, t + fmax(water_step(height, (way.z - change) * side, fall, bend), shortest), t);
        active &= less_equal(before, end);
    }
    // The water lies between the last two places.
    real high = found;
    for (int halving = 0; halving < WATER_HALVINGS; ++halving) {
        if (!any_lane(crossed)) break;
        const real middle = R(0.5) * (before + high);
        const real height = from.z + middle * way.z - water_height(o, from.x + middle * way.x, from.y + middle * way.y, way, &change);
        const mask under = less_equal(height * side, R(0.0));
        high = pick(under, middle, high);
        before = pick(under, before, middle);
    }
    found = pick(crossed, R(0.5) * (before + high), found);
    // Towards the horizon a ray goes through many waves.
    const real rest = -from.z / level;
    return pick(active & less(begin, rest) & less(rest, far), rest, found);
}
