// Lights on the set: thousands of small balls. A place samples one of them: SET_CHOICES are drawn by the probabilities of the grid's
// cell in which it lies, and one of these by what it could bring (resampled importance sampling, Talbot et al. 2005). Rays find
// the balls that they meet in lists of a finer grid (Amanatides and Woo 1987). The host packs all this: `set_lights.py`.
#define SET_CHOICES 8
#define SET_BALL 8      // numbers of a ball: middle, radius, radiance, flags
#define SET_VISIBLE 1
#define SET_SHADOW 2

// A ball for each lane; numbers of balls are whole and small, so that reals hold them.
typedef struct {
    vec center;
    real radius;
    color light;
    mask shadow;
} set_ball;

INLINE set_ball set_ball_of(real number, world w) {
    scalar which[LANES], found[SET_BALL][LANES];
    lanes_store(number, which);
    for (int lane = 0; lane < LANES; ++lane) {
        for (int i = 0; i < SET_BALL; ++i) found[i][lane] = w.set_lights[(int)which[lane] * SET_BALL + i];
    }
    return (set_ball){vec_of(lanes_load(found[0]), lanes_load(found[1]), lanes_load(found[2])), lanes_load(found[3]),
                  color_of(lanes_load(found[4]), lanes_load(found[5]), lanes_load(found[6])),
                  less_equal((real)((scalar)SET_SHADOW), lanes_load(found[7]))};
}

// The probabilities of the cell in which a place lies, as the number where they begin; those outside have the nearest cell's.
INLINE int set_row(scalar x, scalar y, scalar z, world w) {
    const int n = w.settings->set_cells;
    const scalar each = (scalar)n / w.settings->set_edge;
    const int i = clamp((int)clamp((x - w.settings->set_corner[0]) * each, S(0.0), (scalar)n), 0, n - 1);
    const int j = clamp((int)clamp((y - w.settings->set_corner[1]) * each, S(0.0), (scalar)n), 0, n - 1);
    const int k = clamp((int)clamp((z - w.settings->set_corner[2]) * each, S(0.0), (scalar)n), 0, n - 1);
    return w.settings->set_count * SET_BALL + ((k * n + j) * n + i) * (w.settings->set_count + 1);
}

INLINE void set_rows(vec point, world w, int *rows) {
    scalar at[3][LANES];
    vec_store(point, at);
    for (int lane = 0; lane < LANES; ++lane) rows[lane] = set_row(at[0][lane], at[1][lane], at[2][lane], w);
}

// About the irradiance that all balls together can bring to a point.
CALLED real set_weight(const vec *point, world w) {
    int rows[LANES];
    scalar found[LANES];
    set_rows(*point, w, rows);
    for (int lane = 0; lane < LANES; ++lane) found[lane] = w.set_lights[rows[lane] + w.settings->set_count];
    return lanes_load(found);
}

// The probability with which a ball is drawn.
INLINE real set_probability(const int *rows, real number, world w) {
    scalar which[LANES], found[LANES];
    lanes_store(number, which);
    for (int lane = 0; lane < LANES; ++lane) {
        __global const scalar *row = w.set_lights + rows[lane];
        const int i = (int)which[lane];
        found[lane] = row[i] - (i > 0 ? row[i - 1] : S(0.0));
    }
    return lanes_load(found);
}

// The ball at which the running sum passes u.
INLINE real set_drawn(const int *rows, real u, world w) {
    scalar wanted[LANES], found[LANES];
    lanes_store(u, wanted);
    for (int lane = 0; lane < LANES; ++lane) {
        int low = 0, high = w.settings->set_count - 1;
        while (low < high) {
            const int middle = (low + high) / 2;
            if (w.set_lights[rows[lane] + middle] > wanted[lane]) high = middle;
            else low = middle + 1;
        }
        found[lane] = (scalar)low;
    }
    return lanes_load(found);
}

// 1 - cos of half the angle that a ball fills; beyond a half sphere where a place is inside.
INLINE real set_spread(const set_ball *b, vec point) {
    const vec offset = vec_sub(b->center, point);
    const real share = b->radius * b->radius / most(vec_dot(offset, offset), (real)(REAL_SMALLEST));
    return pick(less(share, R(1.0)), share / (R(1.0) + sqrt(most(R(1.0) - share, R(0.0)))), R(2.0));
}

// A ball that was chosen: its number, and one over the density of the choice as an estimate is to take it.
typedef struct {
    real number, weight;
} set_choice;

// The target need not be exact: it is above 0 for all that shine on the point, which keeps the estimate without bias.
INLINE set_choice set_choose(vec point, vec normal, real u, real v, world w) {
    int rows[LANES];
    set_rows(point, w, rows);
    real numbers[SET_CHOICES], weights[SET_CHOICES], targets[SET_CHOICES];
    real sum = R(0.0);
    for (int i = 0; i < SET_CHOICES; ++i) {
        // One from each of SET_CHOICES equal parts: together they have the density of all.
        const real number = set_drawn(rows, (u + (real)((scalar)i)) * (R(1.0) / (real)((scalar)SET_CHOICES)), w);
        const set_ball b = set_ball_of(number, w);
        const vec toward = vec_normalize(vec_sub(b.center, point));
        const real bright = R(0.2126) * b.light.r + R(0.7152) * b.light.g + R(0.0722) * b.light.b;
        const real spread = set_spread(&b, point);
        const real target = pick(less(spread, R(2.0)), bright * spread * (R(0.1) + most(vec_dot(normal, toward), R(0.0))), R(0.0));
        numbers[i] = number;
        targets[i] = target;
        weights[i] = target / (set_probability(rows, number, w) * (real)((scalar)SET_CHOICES));
        sum += weights[i];
    }
    set_choice chosen = {R(0.0), R(0.0)};
    real before = R(0.0);
    mask open = less(R(0.0), sum);
    for (int i = 0; i < SET_CHOICES; ++i) {
        before += weights[i];
        const mask here = open & less(R(0.0), targets[i]) & (i == SET_CHOICES - 1 ? open : less(v * sum, before));
        open &= ~here;
        chosen.number = pick(here, numbers[i], chosen.number);
        chosen.weight = pick(here, sum / pick(here, targets[i], R(1.0)), chosen.weight);
    }
    return chosen;
}

// A direction to a ball, how far it is, and its density per steradian of this ball alone.
INLINE vec set_direction(const set_ball *b, vec point, real u, real v, real *distance, real *density) {
    const real spread = set_spread(b, point);
    const vec offset = vec_sub(b->center, point);
    const vec toward = cone_direction(vec_normalize(offset), least(spread, R(1.0)), u, v);
    const real along = vec_dot(offset, toward);
    const vec across = vec_along(offset, -along, toward);
    *distance = along - sqrt(most(b->radius * b->radius - vec_dot(across, across), R(0.0)));
    *density = R(0.15915494309189535) / spread;
    return toward;
}

// Where a lane's ray meets the nearest ball from outside, before `far`: its number, or -1.
INLINE int set_walk(const scalar *o, const scalar *d, int of_eye, scalar *far, world w) {
    const int n = w.settings->set_lists, cells = w.settings->set_cells, count = w.settings->set_count;
    __global const scalar *starts = w.set_lights + count * SET_BALL + cells * cells * cells * (count + 1);
    __global const scalar *members = starts + n * n * n + 1;
    const scalar size = w.settings->set_edge / (scalar)n;
    scalar enter = S(0.0), leave = *far, next[3], each[3];
    int cell[3], way[3], found = -1;
    for (int i = 0; i < 3; ++i) {
        const scalar low = w.settings->set_corner[i] - o[i], high = low + w.settings->set_edge;
        if (fabs(d[i]) < S(1e-12)) {
            if (low > S(0.0) || high < S(0.0)) return -1;
            continue;
        }
        const scalar a = low / d[i], b = high / d[i];
        enter = fmax(enter, fmin(a, b));
        leave = fmin(leave, fmax(a, b));
    }
    if (!(enter < leave)) return -1;
    for (int i = 0; i < 3; ++i) {
        const scalar place = (o[i] + enter * d[i] - w.settings->set_corner[i]) / size;
        cell[i] = clamp((int)clamp(place, S(0.0), (scalar)n), 0, n - 1);
        const int level = fabs(d[i]) < S(1e-12);
        way[i] = d[i] > S(0.0) ? 1 : -1;
        each[i] = level ? S(1e30) : size / fabs(d[i]);
        const scalar edge = w.settings->set_corner[i] + size * (scalar)(cell[i] + (way[i] > 0 ? 1 : 0));
        next[i] = level ? S(1e30) : (edge - o[i]) / d[i];
    }
    for (int step = 0; step < 3 * n; ++step) {
        const int at = (cell[2] * n + cell[1]) * n + cell[0];
        for (int i = (int)starts[at]; i < (int)starts[at + 1]; ++i) {
            const int number = (int)members[i];
            __global const scalar *ball = w.set_lights + number * SET_BALL;
            if (of_eye && !((int)ball[7] & SET_VISIBLE)) continue;
            const scalar x = ball[0] - o[0], y = ball[1] - o[1], z = ball[2] - o[2];
            const scalar along = x * d[0] + y * d[1] + z * d[2];
            const scalar u = x - along * d[0], v = y - along * d[1], t = z - along * d[2];
            const scalar inside = ball[3] * ball[3] - (u * u + v * v + t * t);
            if (inside < S(0.0)) continue;
            const scalar distance = along - sqrt(inside);
            if (distance > S(0.0) && distance < *far) {
                *far = distance;
                found = number;
            }
        }
        const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
        if (next[axis] > fmin(*far, leave)) break;
        cell[axis] += way[axis];
        if (cell[axis] < 0 || cell[axis] >= n) break;
        next[axis] += each[axis];
    }
    return found;
}

// The nearest ball that rays meet before `far`, as `nearest_light` gives single lights. `density` is what the weights of both ways to find
// it reckon with: that of a place which samples this ball alone. Whatever they reckon with, they add up to 1 (Veach 1997, sec. 9.2).
CALLED mask set_met(const vec *origin, const vec *direction, int of_eye, real *far, color *shows, real *density, real *weight, world w) {
    scalar o[3][LANES], d[3][LANES], reach[LANES], found[LANES];
    vec_store(*origin, o);
    vec_store(*direction, d);
    lanes_store(*far, reach);
    for (int lane = 0; lane < LANES; ++lane) {
        const scalar from[3] = {o[0][lane], o[1][lane], o[2][lane]}, way[3] = {d[0][lane], d[1][lane], d[2][lane]};
        found[lane] = (scalar)set_walk(from, way, of_eye, reach + lane, w);
    }
    const real number = lanes_load(found);
    const mask met = less_equal(R(0.0), number);
    if (!any_lane(met)) return met;
    const real known = most(number, R(0.0));
    const set_ball b = set_ball_of(known, w);
    *far = lanes_load(reach);
    *shows = color_pick(met, b.light, *shows);
    *density = pick(met, R(0.15915494309189535) / set_spread(&b, *origin), *density);
    *weight = pick(met, set_weight(origin, w), *weight);
    return met;
}

INLINE mask met_on_set(vec origin, vec direction, int of_eye, real *far, color *shows, real *density, real *weight, world w) {
    if (w.settings->set_count == 0) return less(R(1.0), R(0.0));
    return set_met(&origin, &direction, of_eye, far, shows, density, weight, w);
}

// One ball's light at an interaction, for shading by Phong's model: `shines` is its colour, and the strength what stands for all balls.
CALLED void set_incidence(const interaction *here, const packet_pixels *at, int number, int bounce, incidence *in, color *shines, mask *shadow, world w) {
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, (uint)(PURPOSE_SET_LIGHT + 16 * bounce));
    real u, v, across, below, density;
    unit_square((bits)((uint)number), seed, &u, &v);
    unit_square((bits)((uint)number), hash_bits(seed + 1u), &across, &below);
    const set_choice chosen = set_choose(here->point, here->normal, u, v, w);
    const set_ball b = set_ball_of(chosen.number, w);
    in->toward = set_direction(&b, here->point, across, below, &in->distance, &density);
    in->strength = R(0.3183098861837907) * chosen.weight / density;
    *shines = b.light;
    *shadow = b.shadow;
}
