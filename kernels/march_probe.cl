// Measures how fast a device marches packets of LANES rays: those of a small picture, and shadow rays from their hits. Nothing is
// shaded, and only the rays' lengths are written, so it compiles in a fraction of a renderer's time; the time of a picture
// is mostly that of the same march.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "rays.h"
#include "march_state.h"
#include "proof.h"
#include "march.h"

// A packet's pixels form a block.
#define BLOCK_WIDTH (LANES == 1 ? 1 : 4)
#define BLOCK_HEIGHT (LANES / BLOCK_WIDTH)

// `met`: of each pixel how far its ray went, or -1, and whether the light is hidden there; `width` is a picture's side, and
// `view` four vectors: the eye, the direction of the picture's middle, one pixel to the right, and the direction to the light.
// Pixels are square, and the picture's up is the rest of a frame.
__kernel void march_probe(__global float *met, __constant const struct March *settings, __constant const struct Orbit *orbit,
                          __constant const scalar *k, __constant const scalar *view, int width) {
    const int left = (int)get_global_id(0) * BLOCK_WIDTH, top = (int)get_global_id(1) * BLOCK_HEIGHT;
    scalar columns[LANES], rows[LANES], far[LANES], hidden[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        columns[lane] = (scalar)(left + lane % BLOCK_WIDTH) + S(0.5) - S(0.5) * (scalar)width;
        rows[lane] = (scalar)(top + lane / BLOCK_WIDTH) + S(0.5) - S(0.5) * (scalar)width;
    }
    const vec axis = vec_splat(view + 3), right = vec_splat(view + 6), toward = vec_splat(view + 9);
    const vec on_plane = vec_along(vec_along(axis, lanes_load(columns), right), lanes_load(rows), vec_cross(axis, right));
    const real inverse = R(1.0) / sqrt(vec_dot(on_plane, on_plane));
    ray r;
    r.origin = vec_splat(view);
    r.direction = vec_scale(on_plane, inverse);
    r.near = R(0.0);
    r.far = (real)(REAL_LARGEST);
    r.footprint = R(0.0);
    r.spread = sqrt(vec_dot(right, right)) * inverse;
    r.known = RAY_NOTHING_KNOWN;

    mask active = equal(R(0.0), R(0.0));
    real went = R(-1.0);
    for (int goal = GOAL_SURFACE; goal < TURNS(GOAL_SHADOW + 1); ++goal) {
        active &= ray_clip(&r, settings->bounds_center, settings->bounds_radius);
        march m = {0};
        march_begin(&m, r, active, goal, settings);
        while (any_lane(m.active)) march_step(&m, goal, settings, orbit, k);
        active &= m.found.hit;
        if (goal == GOAL_SHADOW || !any_lane(active)) break;
        went = pick(active, m.found.t, went);
        const real cone = r.footprint + r.spread * m.found.t;
        r.origin = vec_along(vec_along(r.origin, m.found.t, r.direction), cone * (real)(settings->shadow_lift), toward);
        r.direction = toward;
        r.near = R(0.0);
        r.far = (real)(REAL_LARGEST);
        r.footprint = cone * (real)(settings->shadow_detail);
        r.spread = R(0.0);
    }
    lanes_store(went, far);
    lanes_store(pick(active & less_equal(R(0.0), went), R(1.0), R(0.0)), hidden);
    for (int lane = 0; lane < LANES; ++lane) {
        const int pixel = (top + lane / BLOCK_WIDTH) * width + left + lane % BLOCK_WIDTH;
        met[2 * pixel] = (float)far[lane];
        met[2 * pixel + 1] = (float)hidden[lane];
    }
}
