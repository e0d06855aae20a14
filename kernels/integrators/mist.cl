// Entry point that knows the formula: the fog around the set that the eye's ray goes through.
#include "formulas/orbits.h"
#include "integrators/stages.h"
#include "shading/fog.h"

// Its density at a place is density / (1 + x^2), x = (d - distance) / width, d the distance to the set; by counts density * s^2, s from 0
// at one escape count to 1 at another. What is behind the ray's way through it comes by exp(-its integral).
//
// The integral is estimated without bias whatever the steps are, as that of a glow: each part of the way is as long as what was found in
// the last one allows, and is asked at one random place of its own. So no step shows. Parts are short where the fog is thick, or the
// exponential of the estimate would be biased.
#define MIST_BEYOND R(64.0)    // widths around the bounds: what is farther off is less than a hundredth of a way straight down
#define MIST_PART R(0.3)       // a part, in what the density changes over
#define MIST_MOST R(0.2)       // and the most optical thickness of one, as far as is known
#define MIST_THICKEST R(9.0)   // optical thickness behind which nothing is seen
#define MIST_PARTS 256         // most parts of a way
#define MIST_FARTHEST R(1e9)   // widths: float32 holds the square

// How dense it is at a place; `quantity`: what chooses its colour; `scale`: over what length the density changes, about.
INLINE real mist_at(vec point, mask active, real *quantity, real *scale, counters *cost, world w, orbit_record orbit, constants k) {
    material_record m = w.material;
    clearance here;
    real density = (real)(m->mist_density);
    if (m->mist_by_count) {
        surface_point surface;
        here = orbit_dual_distance(point, active, OF_SURFACE, orbit, k, &surface);
        *quantity = smooth_count(here.end, surface, orbit);
        *scale = here.step;
        const real share = bounded((*quantity - (real)(m->mist_start)) * (real)(m->mist_rise), R(0.0), R(1.0));
        density *= share * share;
    } else {
        here = orbit_distance(point, active, orbit, k);
        // Estimates are made for near the set, and far out may be a half of the distance, which is no less than that from the bounds.
        // This takes over little by little, or the fog would show how round these are.
        const vec arm = vec_sub(point, vec_splat(w.settings->bounds_center));
        const real width = (real)(m->mist_width), radius = (real)(w.settings->bounds_radius), beyond = sqrt(vec_dot(arm, arm)) - radius;
        const real outside = bounded(beyond / radius, R(0.0), R(1.0));
        *quantity = here.step + outside * fmax(beyond - here.step, R(0.0));
        const real away = fmin(fabs(*quantity - (real)(m->mist_distance)) / width, MIST_FARTHEST);
        const real square = R(1.0) + away * away;
        *scale = width * sqrt(square);
        density /= square;
    }
    cost->steps += pick(active, R(1.0), R(0.0));
    cost->count += pick(active, here.end.count, R(0.0));
    return pick(active, density, R(0.0));
}

// Its colour by a distance or a count: stops that are not reached yet, and those that there are not, change nothing.
INLINE color mist_color(real quantity, material_record m) {
    color found = color_splat(m->mist_colors);
    for (int i = 1; i < MIST_STOPS; ++i) {
        const real share = bounded((quantity - (real)(m->mist_at[i - 1])) * (real)(m->mist_slope[i]), R(0.0), R(1.0));
        found = color_mix(found, color_splat(m->mist_colors + 3 * i), share);
    }
    return found;
}

// The part of light that the fog that lies elsewhere lets through to the eye.
INLINE real fog_passes(ray r, real way, world w) {
    return HAS(w, FOG) ? exp(-fog_depth(r.origin, r.direction, way, w.material)) : R(1.0);
}

// What a ray sees of it from `r.near` to `r.far`.
INLINE mist_seen mist_along(ray r, mask active, bits seed, counters *cost, world w, orbit_record orbit, constants k) {
    real fog = fog_passes(r, r.near, w), thickness = R(0.0), through = R(1.0), t = r.near, dimmed = R(0.0);
    color light = color_of(R(0.0), R(0.0), R(0.0));
    const mask meets = active & less(r.near, r.far);
    real part = MIST_PART * (real)(w.material->mist_width);
    for (int i = 0; i < MIST_PARTS; ++i) {
        active &= less(t, r.far) & less(thickness, MIST_THICKEST);
        if (!any_lane(active)) break;
        // The last parts reach the end, however short the others were.
        const real least_part = (r.far - t) / (real)((scalar)(MIST_PARTS - i));
        part = fmin(fmax(part, least_part), r.far - t);
        const real place = t + part * unit_of_bits(hash_bits(seed + 0x9e3779b9u * (uint)(i + 1)));
        real quantity, scale;
        const real density = mist_at(vec_along(r.origin, place, r.direction), active, &quantity, &scale, cost, w, orbit, k);
        thickness += pick(active, density * part, R(0.0));
        const real then = exp(-thickness), fog_then = fog_passes(r, t + part, w);
        const real shines = pick(active, (through - then) * R(0.5) * (fog + fog_then), R(0.0));
        light = color_add(light, color_scale(mist_color(quantity, w.material), shines));
        dimmed += pick(active, (fog - fog_then) * (R(1.0) - R(0.5) * (through + then)), R(0.0));
        through = pick(active, then, through);
        fog = pick(active, fog_then, fog);
        t = pick(active, t + part, t);
        part = fmin(MIST_PART * scale, MIST_MOST / fmax(density, (real)(REAL_SMALLEST)));
    }
    // All the other fog so far is dimmed like what is behind the way, when samples end: what of it lies in front is less so.
    const real before = (R(1.0) - fog) * (R(1.0) - through) - dimmed;
    const mist_seen found = {color_pick(meets, light, color_of(R(0.0), R(0.0), R(0.0))), pick(meets, through, R(1.0)),
                             pick(meets, before, R(0.0))};
    return found;
}

// Keeps what the eye's ray sees to the end of the sample.
STAGE(find_mist) {
    STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const camera_sample a = camera_sample_kept(s);
    const interaction found = interaction_kept(s, 0);
    ray r = eye_ray(&a, view);
    r.far = pick(mask_of(found.found), vec_dot(vec_sub(found.seen, r.origin), r.direction), r.far);
    real ignored;
    const mask clear = planes_cut(&r, &ignored, w.planes) & fog_at_eye(r.origin, w);
    const real around = (real)(material->mist_distance) + MIST_BEYOND * (real)(material->mist_width);
    const mask near = ray_clip(&r, settings->bounds_center, (real)(settings->bounds_radius) + around);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    const bits seed = hash_bits(pixel_seed(here.at.columns, here.at.rows, (uint)settings->seed, PURPOSE_MIST)
                                + (bits)((uint)sample * 0x85ebca6bu));
    const mist_seen seen = mist_along(r, mask_of(a.wanted) & clear & near, seed, &cost, w, orbit, k);
    STATE_KEEP(s, cost, STATE_COUNTERS);
    STATE_KEEP(s, seen, STATE_MIST);
}
