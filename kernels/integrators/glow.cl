// Entry point that knows the formula: the glow around the set that each ray of a path goes through.
#include "formulas/orbits.h"
#include "integrators/stages.h"
#include "formulas/orbit_told.h"
#include "shading/fog.h"

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
INLINE real glow_along(ray r, mask active, bits seed, counters *cost, world w, orbit_record orbit, constants k) {
    material_record m = w.material;
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
        if (m->glow_trap != 0) {
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

// Keeps what the eye's ray sees to the end of the sample; what others see is light of their paths.
STAGE(add_glow) {
    STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const camera_sample a = camera_sample_kept(s);
    const interaction found = interaction_kept(s, bounce);
    path so_far;
    ray r = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    const mask wanted = mask_of(bounce == 0 ? a.wanted : so_far.on_path);
    r.far = pick(mask_of(found.found), vec_dot(vec_sub(found.seen, r.origin), r.direction), r.far);
    real ignored;
    const mask clear = planes_cut(&r, &ignored, w.planes);
    const mask near = ray_clip(&r, settings->bounds_center, (real)(settings->bounds_radius) + GLOW_BEYOND * (real)(material->glow_width));
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    const bits seed = hash_bits(pixel_seed(here.at.columns, here.at.rows, (uint)settings->seed, PURPOSE_GLOW + 16u * (uint)bounce)
                                + (bits)((uint)sample * 0x85ebca6bu));
    const real strength = glow_along(r, wanted & clear & near, seed, &cost, w, orbit, k);
    STATE_KEEP(s, cost, STATE_COUNTERS);
    const color glow = color_scale(color_splat(material->glow_color), strength);
    if (bounce == 0) {
        STATE_KEEP(s, glow, STATE_GLOW);
    } else {
        so_far.seen = color_add(so_far.seen, color_mul(glow, so_far.through));
        STATE_KEEP(s, so_far, STATE_PATH);
    }
}
