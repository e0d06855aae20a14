// Escape of points of a plane: exact counts without distances, and early detection of periodic orbits.
//
// From the build: CYCLE, applications after which whose turn it is in a chain repeats itself; REPEATS_FROM, the one from which on it
// does.

// Applications between two tests for a periodic orbit, or as many whole cycles: few cost time, many find it late.
#define PERIOD_CHECK 8

// Whether two numbers have the same bits: unlike `equal`, this distinguishes +0 and -0.
#define same_bits(a, b) equal_ints(as_whole(a), as_whole(b))

typedef struct {
    real count;         // applications until |z| > bailout, whole or smooth; the limit for points that never get there
    mask inside;
    real applications;  // that it took to know
} escaped;

// The escape of points within `most` applications. `smooth` (0 or 1, best a constant): counts go on to the distance bailout and are smooth, with the inside
// of the distances (packet_orbits.h); else they are whole, those of `formula_escape_count`.
//
// A point whose z has the very bits that it had some applications earlier (a multiple of CYCLE) repeats itself for
// ever and never escapes. z is compared with one that is kept, and replaced by the present one at doubling intervals (Brent
// 1980, An Improved Monte Carlo Factorization Algorithm, sec. 2): any cycle is found, of any length. Nothing but exact equality
// will do: an orbit that comes near itself may still escape. `periodicity` 0 skips this test, for comparison.
INLINE escaped escape_by(int usual, vec point, mask active, int smooth, int periodicity, int most, orbit_record orbit,
                            constants k) {
    state c, z;
    start(point, k, &c, &z);
    const real radius_square = (real)(smooth ? orbit->distance_square : orbit->bailout_square);
    real square = state_square(z);
    real square_before = square;
    const int first = ORBIT_FIRST(z, active);
    real count = (real)((scalar)min(first, most));
    mask alive = active & less_equal(square, radius_square);
    mask inside = active & ~active;
    state kept = z;
    real highest = square;  // |z|^2 since then
    const int check = CYCLE * max(1, PERIOD_CHECK / CYCLE);
    int next_keep = first + check;
    // Equal states have equal futures only where the turns repeat.
    int kept_at = first, comparable = first >= REPEATS_FROM;
    int n = first, limit = most;
    for (int past_limit = 0; past_limit <= smooth; ++past_limit) {
        while (n < limit) {
            if (!any_lane(alive) || orbit_cancelled(orbit)) break;
            const int end = min(n + check, limit);
            for (; n < end; ++n) {
                if (!any_lane(alive)) break;
                const mask applied = going_on(alive);
                z = state_pick(applied, apply_by(usual, n, z, c, k), z);
                if (!LOGARITHMIC) square_before = pick(applied, square, square_before);
                square = state_square(z);
                count += pick(applied, R(1.0), R(0.0));
                alive = applied & less_equal(square, radius_square);
                if (!ENDS_BY_SHAPE && smooth) highest = fmax(highest, square);
            }
            if (!ENDS_BY_SHAPE && periodicity) {
                mask back = alive & HAS_BEGUN(z);
#define BACK(s) back &= same_bits(z.s, kept.s);
                STATE_EACH(BACK)
                // An orbit that comes and goes between the two radii is inside or not by the last application.
                if (smooth) back &= less_equal(highest, (real)(orbit->bailout_square));
                if (comparable && (n - kept_at) % CYCLE == 0) {
                    inside |= back;
                    alive &= ~back;
                }
                if (n >= next_keep) {
                    comparable = n >= REPEATS_FROM;
                    kept_at = n;
                    kept = z;
                    highest = square;
                    next_keep = 2 * n;
                }
            }
        }
        if (past_limit) break;
        // At the limit: inside, or on the way from the bailout to the distance bailout.
        if (ENDS_BY_SHAPE) inside |= alive & less_equal(solid_distance(z, k), R(0.0));
        else inside |= smooth ? alive & in_set(square, orbit) : alive;
        alive &= ~inside;
        limit = most + (orbit->longest - orbit->iterations);
    }
    const orbit_end last = {count, inside};
    const orbit_result result = {.square = square, .square_before = square_before};
    const real found = smooth ? formula_smooth_count(last, result, orbit) : count;
    return (escaped){pick(inside, (real)((scalar)most), found), inside, count};
}

CALLED void other_escape(const vec *point, const mask *active, int smooth, int periodicity, int most, escaped *found,
                         orbit_record orbit, constants k) {
    *found = escape_by(0, *point, *active, smooth, periodicity, most, orbit, k);
}

#define USUAL_ESCAPE(usual) case usual: return escape_by(usual, point, active, smooth, periodicity, most, orbit, k);
INLINE escaped formula_escape(vec point, mask active, int smooth, int periodicity, int most, orbit_record orbit, constants k) {
    USUALLY(USUAL_ESCAPE)
    escaped found;
    other_escape(&point, &active, smooth, periodicity, most, &found, orbit, k);
    return found;
}

// Of several solids that are joined counts are the largest of what is beside each other, and the smaller of both where only what they
// have in common is left. A formula has its own limit, unless the plane has one.
INLINE escaped one_escape(vec own, mask active, int smooth, int periodicity, int limit, orbit_record o, constants k) {
    escaped one = {R(0.0), active & ~active, R(0.0)};
    if (o->kind != SOLID_FORMULA) {
        one.inside = active & simple_holds(o, own);
        return one;
    }
    return formula_escape(own, active, smooth, periodicity, limit, o, k + o->first);
}

CALLED escaped solids_escape(const vec *point, mask active, int smooth, int periodicity, int most,
                             orbit_record orbit, constants k) {
    const real limit = (real)((scalar)most);
    escaped all = {R(0.0), active & ~active, R(0.0)};
    for (int i = 0; i < orbit->solids; ++i) {
        orbit_record o = orbit + i;
        const int own = most == orbit->iterations ? o->iterations : most;
        escaped one = one_escape(solid_own(o, *point), active, smooth, periodicity, own, o, k);
        if (o->planes > 0) {
            const mask left = solid_left(o, *point, active);
            one.inside &= left;
            one.count = pick(left, one.count, R(0.0));
        }
        const real count = pick(one.inside, limit, fmin(one.count, limit));
        all.applications += one.applications;
        all.inside = inside_joined(o->join, all.inside, one.inside);
        if (o->join == JOIN_CUT) all.count = pick(one.inside, R(0.0), all.count);
        else if (o->join == JOIN_INTERSECTION) all.count = fmin(all.count, count);
        else all.count = fmax(all.count, count);
    }
    if (orbit->flows) {
        all.inside |= orbit_inside(*point, active, most, orbit, k);
        all.count = pick(all.inside, limit, all.count);
    }
    return all;
}

INLINE escaped plane_escape(vec point, mask active, int smooth, int periodicity, int most, orbit_record orbit, constants k) {
    if (!JOINED) return formula_escape(point, active, smooth, periodicity, most, orbit, k);
    return solids_escape(&point, active, smooth, periodicity, most, orbit, k);
}
