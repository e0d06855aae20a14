// Light around the set. Each place of a ray adds exp(-d / width) / width for each unit of its way, d the distance to the set; by a
// trap that times exp(-q / reach), q the smallest distance of the place's orbit from the trap. A ray that goes straight down to a
// plane adds 1 in all.
//
// The integral is estimated without bias whatever the steps are: a part of the way begins where the last one ends, is as long as the
// distance found in the last one allows, and is asked at one random place of its own (a martingale). So no step shows.
#define GLOW_BEYOND R(32.0)  // widths around the bounds: farther off is less than e^-8, even where the estimate is a quarter
#define GLOW_PART R(0.5)     // a part, in widths or distances, whichever are longer
#define GLOW_PARTS 256       // most parts of a way

// What a ray from `r.near` to `r.far` sees of the glow, for an intensity of 1.
INLINE real glow_along(ray r, mask active, bits seed, tally *cost, world w, __constant const struct Orbit *orbit,
                       __constant const scalar *k) {
    __constant const struct Material *m = w.material;
    const real width = (real)(m->glow_width), widest = (real)(w.settings->bounds_radius);
    const real least_part = (r.far - r.near) * R(0.00390625);
    real sum = R(0.0), t = r.near, part = fmax(GLOW_PART * width, least_part);
    for (int i = 0; i < GLOW_PARTS; ++i) {
        active &= less(t, r.far);
        if (!any_lane(active)) break;
        part = fmin(part, r.far - t);
        const real place = t + part * unit_of_bits(hash_bits(seed + 0x9e3779b9u * (uint)(i + 1)));
        const vec point = vec_along(r.origin, place, r.direction);
        const clearance here = orbit_distance(point, active, orbit, k);
        real bright = exp(-fmin(here.step / width, R(80.0)));
        if (m->glow_trap >= 0) {
            const trap near = {m->glow_trap, vec_splat(m->glow_center), vec_splat(m->glow_direction), (real)(m->glow_radius)};
            bright *= exp(-fmin(orbit_near(near, point, active, orbit, k) / (real)(m->glow_reach), R(80.0)));
        }
        if (HAS(w, FOG)) bright *= exp(-fog_depth(r.origin, r.direction, place, m));
        sum += pick(active, part * bright, R(0.0));
        cost->steps += pick(active, R(1.0), R(0.0));
        cost->count += pick(active, here.end.count, R(0.0));
        t = pick(active, t + part, t);
        part = fmax(GLOW_PART * fmax(width, fmin(here.step, widest)), least_part);
    }
    return sum / width;
}
