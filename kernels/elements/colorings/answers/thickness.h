// How long the way from a point of the surface through the set is, from where it enters the set to where it first leaves it:
// 0 where the set does not begin within ENTRANCE_REACH or a step, at most `coloring_limit`.

// In footprints: how far behind a point of the surface the set may begin, and the first place to test. A distance of one
// footprint, which is a hit, is a lower bound; rough fractals have their solid at three (median) to ten.
#define ENTRANCE_REACH R(16.0)
#define ENTRANCE_START R(0.0625)

INLINE real thickness_answer(vec point, vec normal, vec view_direction, real cone, mask active, material_record material,
                             orbit_record orbit, constants k) {
    const vec direction = material->along == ALONG_VIEW ? view_direction : vec_scale(normal, R(-1.0));
    const real step = (real)(material->coloring_step), limit = (real)(material->coloring_limit);
    real begin = R(0.0), shortest = fmax(ENTRANCE_START * cone, WAY_TOLERANCE * step);
    real longest = fmax(ENTRANCE_REACH * cone, step), farthest = longest;
    real entrance = R(0.0), thickness = R(0.0);
    // One loop for both ends, so that the orbit is compiled once.
    for (int end = 0; end < 2; ++end) {
        const gate met = way_until(end == 0, point, direction, begin, shortest, longest, farthest, orbit->iterations, active,
                                   material, orbit, k);
        const real middle = R(0.5) * (met.before + met.beyond);
        if (end == 0) {
            active = met.found;
            entrance = middle;
            begin = pick(active, met.beyond, R(0.0));
            // Full steps from the start: growing steps would find every pore behind the surface.
            shortest = step;
            longest = step;
            farthest = begin + limit;
        } else {
            thickness = pick(met.found, fmin(middle - entrance, limit), limit);
        }
    }
    return pick(active, thickness, R(0.0));
}
